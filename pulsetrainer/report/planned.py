"""What a dry run says of the plan that a verb made (``plan`` in its step): what, for how long, how hot."""

from __future__ import annotations

from typing import Any


def to_be_captured(plan: Any, limit_N: float | None) -> dict[str, Any]:
    """Say what a capture would play; the device stops above ``limit_N``."""
    length = f"{plan.seconds - plan.conditioning_s:.1f} s"
    around = f", after {plan.conditioning_s:.1f} s around the major loop" if plan.conditioning_s else ""
    above = f"known once it is measured; above {limit_N:g} N the device stops" if limit_N is not None else ""
    return {
        "length": length + around,
        "samples": f"{plan.samples}, {plan.rate_Hz:g} a second",
        "reversals": plan.reversals,
        "cells switched": f"{plan.coverage_percent:.1f} %",
        **({"force": above} if above else {}),
    }


def to_be_played(plan: Any, repeats: int) -> dict[str, str]:
    """Say how a drive would be played."""
    return {"repeats": f"{repeats} of each drive, {plan.seconds:.1f} s in all"} | _of_a_drive(plan)


def to_be_refined(plan: Any, passes: int) -> dict[str, str]:
    """Say how a drive would be refined."""
    return {
        "passes": f"at most {passes}, {plan.seconds:.1f} s in all",
        **_of_a_drive(plan),
        "rehearsed": "the first pass, which plays the drive as it is; what it shows decides the others",
    }


def _of_a_drive(plan: Any) -> dict[str, str]:
    """Say how long a drive is, and how hard it presses: before a small pulse harder than in it."""
    return {
        "samples": f"{plan.samples} a repeat, {plan.rate_Hz:g} a second",
        "force": f"{plan.peak_force_N:.2f} N at most, by the model, as each repeat begins; "
        f"{plan.pulse_force_N:.2f} N in the pulse",
    }


def to_be_tuned(plan: Any) -> dict[str, str]:
    """Say what tuning would play, step by step."""
    steps = {
        f"{number}. {step.what}": f"{step.seconds:.2f} s up to {step.peak_A:.3f} A"
        + ("" if step.gains == "none" else f", gains {step.gains}")
        for number, step in enumerate(plan.steps, 1)
    }
    return steps | {
        "length": f"{plan.seconds:.1f} s at most",
        "limits": f"{plan.current_limit_A:g} A; above {plan.force_limit_N:g} N the device stops",
        "heat": f"{plan.heat_percent:.0f} % of the limit at most, from cold",
    }


def to_be_pressed(plan: Any, limit_N: float | None) -> dict[str, str]:
    """Say what a session would press; the device stops above ``limit_N``."""
    pauses = sum(pause.seconds for pause in plan.pauses)
    limit = f"the device stays on for {plan.longest_part_s / 60:.0f} minutes in one go"
    above = "" if limit_N is None else f"; above {limit_N:g} N the device stops"
    return {
        "beats": ", ".join(f"{count} of {name}" for name, count in plan.pulses.items()),
        "length": f"{plan.seconds / 60:.1f} minutes, {plan.seconds:.0f} s",
        "parts": f"{plan.parts}: {limit}",
        "heat": f"{plan.heat_percent:.0f} % of the limit at most, from cold; "
        + (f"{len(plan.pauses)} pauses to cool, {pauses:.0f} s in all" if pauses else "no pause to cool"),
        "force": f"{plan.peak_force_N:.2f} N at most, by the model, as each part begins; "
        f"{plan.pulse_force_N:.2f} N in the pulses{above}",
    }
