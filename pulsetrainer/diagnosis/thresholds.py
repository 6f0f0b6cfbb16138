"""Every number that decides something in a diagnosis; those of one cause are in the file of that cause.

Where a line names no other origin, the number was set on the tuning seeds of docs/blind.md (4242, 7000 to
7302, 500000 to 500109) and then frozen. The grids of that page tested it on other seeds.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The numbers of the procedure; each line says what the number guards."""

    # The units of a record: its own second, see ``scale``; all times below are in it
    path_piece: float = 0.05  # ranges of the input: length of the pieces of its path whose times are compared
    crossings: float = 4.286  # of the range in one second: the diagnostic signal's, on which all was tuned
    most_seconds: float = 3000.0  # in all records: with more the input hardly moves, and has no typical rate
    span_quantiles: tuple[float, float] = (0.001, 0.999)  # of the output: the span lies between them

    # Preparing a record
    fastest_Hz: float = 1000.0  # samples a second: faster records are averaged down ...
    most_samples: int = 20_000  # ... but to no fewer samples than these
    least_samples: int = 100  # in a record: with fewer any cause can fit
    even_within: float = 0.1  # time steps: time stamps as near as this to even ones count as even
    gap_steps: float = 1.5  # usual time steps: a longer step is a gap; the samples that fill it do not count
    usual_of: int = 31  # neighbouring time steps: their median is the usual step, as rates differ in a record
    most_even: int = 2_000_000  # even time steps that a record is resampled to
    least_present: float = 0.5  # share of a record's even steps that must be there
    beyond_range: float = 0.02  # of the model's range: input farther out than this lies outside the range
    least_inside: float = 0.5  # share of the input in the model's range: with less it is another device
    bin_s: float = 0.005  # length of an average: short enough for a resonance of 70 Hz ...
    enough_rows: int = 4000  # ... and for at least this many averages, where there are as many samples
    rows_at_once: int = 2000  # converted from nodes to cells at once: more take more memory, and save no time
    most_rows: int = 20_000  # averages: longer records get longer averages, so that the fit fits in memory
    short_filter: int = 60  # averages: a lag that forgets within this many leaves the rows of a fit sparse
    least_rows: int = 100  # averages: fewer cannot tell causes apart
    start_tau_s: tuple[float, ...] = (0.2, 0.8, 3.2)  # decays fitted from a record's start (decision 040)
    start_share: float = 6.0  # time constants of such a decay that a record must hold: slower is an offset
    bulk_of_values: tuple[float, float] = (0.1, 0.9)  # quantiles of distinct values: none between is wild
    same_value: float = 1e-9  # of the span: outputs nearer than this are one value, rounded
    jump_of_input: float = 0.1  # of its range from one sample to the next: there the output jumps too
    noise_least: int = 8  # third differences: fewer give no estimate of the noise
    folded: float = 0.4  # periods of a hum in an average: half a period is seen at another frequency
    line_around: int = 100  # lines of the spectrum on each side of a hum: their median ...
    line_stands: float = 10.0  # ... is exceeded this many times; in 100 000 lines of noise by 4.1 at most
    line_share: float = 0.5  # of the squares of third differences: a line with more is a hum, not noise ...
    line_samples: int = 1000  # ... if there are this many samples: of fewer, one line has much by chance
    line_wide: int = 3  # lines on each side: so far a window spreads a line
    coarse_reading: float = 0.004  # of the input's range: a reading in finer steps harms no fit
    least_held: int = 100  # readings held between two steps in the same direction: fewer show nothing
    read_evenly: float = 0.5  # of an even motion while the reading is held: such an output saw no steps
    not_between: float = 0.5  # of a coarse step of the input: the uncertainty beside turns and rests
    coarse_noise: float = 1.8  # times the noise: with it, 0.7 % of steps of 2 sigma do not average out
    steps_apart: float = 2.5  # coarse steps: smaller jumps are those steps themselves
    state: float = 0.15  # of the span: values farther apart are the states of a device that switches

    # Static fit
    levels: int = 32  # of the plane on which causes are sought: finer ones take longer, with the same verdict
    coarse_levels: int = 22  # of the plane that shows how the discretisation error falls with the cell
    smoothing: float = 0.035  # of the density, share of the range: makes the fit stable at the levels above
    near_end: float = 0.01  # of the range: over this width the outputs at its two ends are averaged
    shown_kept: int = 12  # outputs kept, at the full rate, of what chains of causes begin with
    followed_kept: int = 10  # inputs kept together with their way through the plane: some 10 MB each
    ridge: float = 1e-10  # of the largest diagonal entry: keeps the factor of the positive cells regular
    rounding: float = 1e-12  # of a sum of squares: a smaller difference of two sums is only rounding
    ridge_held_out: float = 1e-9  # relative: the same, where blocks are left out
    ridge_steps: float = 1e-9  # relative: the same, for the step of the parameters

    # Joint refit
    refit_rounds: int = 6  # Gauss-Newton steps of a refit
    trial_rounds: int = 3  # steps for a candidate, to rank it; the accepted one gets a full refit
    rival_rounds: int = 2  # steps for a rival: enough to show whether it comes close
    without_rounds: int = 1  # steps after a cause was taken out of a model: the others move little
    passes: int = 8  # at most, between the weights and what the output causes add (decision 041)
    passes_settled: float = 0.05  # of the residual: passes end when what the causes add changes by less
    hopeless: float = 4.0  # times its last fall: a refit farther than this from its goal is given up
    enough: float = 2e-3  # relative fall of the sum of squares: below it the refit ends
    difference: float = 0.02  # of a parameter's value: step of its derivative, if larger than the cause's
    step_tries: int = 4  # dampings tried for one step
    damping_falls: float = 0.3  # factor after a step that helps
    damping_rises: float = 10.0  # factor after one that does not
    damping_least: float = 0.1  # damping after the first step that does not help
    step_factor: float = 3.0  # a positive parameter moves at most by this factor in one step

    # Floor: what is irrelevant
    relevant_noise: float = 0.3  # of the noise of an average: smaller effects are irrelevant
    relevant_span: float = 0.0003  # of the span: smaller effects are irrelevant on any device (decision 044)
    least_reducible: float = 1e-12  # of the baseline's squares: keeps shares finite

    # How large the noise is
    octaves: int = 6  # in which the noise is estimated: 1.6 Hz and faster
    least_quiet: int = 800  # averages at rest: if there are fewer, the slowest averages are used ...
    slowest: float = 0.3  # ... which are this share of all
    slope_octaves: int = 3  # the slowest of the octaves: slower noise is extrapolated from them
    steepest: float = 1.2  # power of the period with which a spectrum may rise: pink noise has 1
    trimmed: float = 0.05  # of the averages of a band: the largest ones are not noise
    trimmed_moving: float = 0.5  # the same where the input never rests: in motion the model errs more
    impulse: float = 3.5  # standard deviations: an average farther out ...
    alone: float = 2.0  # ... and this many times larger than its neighbours belongs to a heavy tail
    slow_doubt: float = 4.0  # times what is extrapolated: slow errors no larger than that count as noise

    # Screening and its null
    p_max: float = 0.01  # over the whole library: in a hundred searches one false alarm is accepted
    share_unsure: float = 1.8  # times: what weights leave of an effect is unsure; at 1 half were missed
    nine_of_ten: float = 1.2816  # standard deviations above the limit: nine of ten such effects are found
    halves: tuple[float, float, int] = (1.0, 200.0, 4000)  # half squares among which a line's limit is sought
    slow_noise: float = 3.0  # times the noise from sample to sample: an average with more contains slow noise
    burstiness: float = 4.5  # kurtosis in octaves: drawn noises have 2.9 to 4, bursts and loads 5.5 to 8
    bursts_span: float = 0.004  # of the span: on devices of other kinds, less than this comes in bursts
    matters: float = 0.005  # of the span: so large an effect must show, or nothing can be said; by convention
    draws: int = 1999  # of the noise: the smallest possible p is a twentieth of the limit
    probes: int = 12  # white signals that show how much of a spectrum the weights and the library take away
    band: float = 1.15  # of its frequency: the width of a band of the noise's spectrum ...
    least_lines: int = 4  # ... which has at least this many lines
    median_lines: int = 12  # lines: a band of this many is a median, so that one line of a hum is not noise
    least_seen: float = 0.2  # of a probe: a band that keeps less than this shows nothing
    least_left: float = 0.05  # of a probe, or of the largest noise: keeps ratios finite
    visible: float = 1e-6  # of a column: if the weights leave less than this, it is rounding
    rank: float = 1e-3  # of the largest singular value: smaller ones of the library's columns are rounding
    start_falls: float = 0.2  # a linearised strength starts a refit within this ...
    start_rises: float = 5.0  # ... and this factor of the value that was tried

    # Accepting a cause
    most_causes: int = 5  # at once: more were never right
    most_steps: int = 5  # at once: more pieces would follow anything slow
    steps_leave: float = 0.1  # of what every other cause leaves above quick noise: false ones leave 0.29
    one_step: float = 0.2  # of what is left above quick noise: one step of several takes away more
    one_moment: float = 1.5  # distances between moments tried: nearer ones are the same step
    tried: int = 3  # candidates refitted in each round
    linearised: float = 0.5  # of the gain of a refit: a linearised score shows this much (decision 044)
    nearly: float = 0.75  # of the relevant fall: a candidate that reaches this is refitted until it converges
    held_out_least: float = 0.05  # of the reducible held-out error: a smaller fall is no improvement
    held_out_kept: float = 0.33  # of that error: in devices of other kinds true causes reach 0.43, false 0.28
    half: float = 0.5  # of that error: in devices of other kinds steps reach 0.55, false ones 0.44
    least_share: float = 0.002  # of what all causes explain: less is what the formulas of the others miss
    blocks: int = 20  # of a record, cut where a major loop wipes its memory out
    jackknife: int = 10  # parts left out in turn for the intervals
    rows_per_unknown: int = 2  # averages that must stay for each unknown when blocks are left out
    start_kept: float = 0.01  # of a column's squared norm: keeps a start defined when its block is left out

    # Repetition
    pieces: int = 5  # into which the whole time is cut, each predicted from the others
    rates: int = 4  # groups of blocks by their rate, each predicted from the others
    repeated: float = 0.5  # of the gain of the fit: a smaller gain on the pieces may be chance
    mends: float = 0.1  # of what can be explained: with less, a cause that may be nothing is not found
    held_by_the_rest: float = 0.035  # of a fault's squares: other kinds leave up to 0.035, true faults 0.039
    two_sizes: float = 2.0  # ratio: told so differently by two fits, a fault has another course (2.5 to 3.1)
    even_drift: float = 4.0  # mean square of a drift that goes on evenly from zero, over its variance
    predicts_though_held: float = 0.8  # of the reducible held-out error: true drifts, though absorbed, 0.85
    told_though_held: float = 0.001  # of the span, rms: an absorbed fault that explains more is reported
    piece_worse: float = 0.1  # of that gain: no piece may be predicted worse by more than this
    piece_told: float = 0.02  # weight of a piece left out: enough where the others do not determine a weight
    wander_pieces: int = 10  # of the time: if a gain and an offset for each ...
    stretch_holds: float = 0.8  # of what a step takes away: if so much lies in one stretch, shorter ...
    stretch_of_side: float = 0.6  # ... than this share of its shorter side, it is an event (steps: 1.25 up)
    stretches: int = 100  # lengths of a stretch that are tried
    wander_left: float = 0.33  # ... take away this share of what is left (true drifts: up to 0.15) ...
    wander_fall: float = 0.1  # ... and this share of what a drift took away, the record wanders
    wander_knots: int = 16  # of a zero that follows the time: it turns every twelfth of a record at most
    gain_in_use: float = 0.6  # of the gain of the causes in the search: true ones keep 0.68 and more
    begin_share: float = 0.2  # of a record: what was going on before it has decayed by then
    settled_times: float = 5.0  # of the longest time constant: after such a rest 0.7 % is still to come
    slow_share: float = 0.4  # of what is left: if more than this may be slow noise, the bank is searched too

    # Unlisted
    as_well: float = 0.7  # of the best prediction: if both the gain and the output reach it, both are tried
    other_tau: float = 1.5  # ratio of time constants: two curves over one state that are nearer are the same
    most_states: int = 3  # that are learned, one after another
    learned_rounds: int = 4  # Gauss-Newton steps of the joint refit with each
    fastest_state_s: float = 0.05  # the fastest time constant of the bank: a faster state would mend a lag
    nearly_all: float = 0.9  # of what a curve in their place explains: listed causes with it keep their names
    learned_predicts: float = 0.75  # of the reducible held-out error: a mere imitation reaches 0.7
    imperfect: float = 0.08  # of what listed causes explain: their formulas may miss this much
    slowest_state: float = 0.25  # of the longest record: the slowest time constant of the bank
    state_ratio: float = 2.0  # from one time constant of the bank to the next; the best is refined within ...
    bank_draws: int = 299  # of the noise, each scored on the whole bank: p is at least a third of the limit
    state_settled: float = 0.02  # ... to this relative error
    state_ends: tuple[float, float] = (0.002, 0.998)  # quantiles between which a curve is drawn
    curve_ridge: float = 1e-3  # of the mean square of a curve's columns: keeps its second differences small
    curve_places: int = 41  # points in the figure of a curve
    curve_bulk: tuple[float, float] = (0.02, 0.98)  # quantiles of the state: outside, a record shows little

    # Equal loops (decision 042)
    contrast_p_max: float = 0.001  # for the second of two tests: 0.005 gave false alarms in 3 of 141 controls
    permutations: int = 1999  # of equal loops: the smallest possible p is half of the limit
    loop_places: int = 12  # averages along each branch
    loop_same: float = 0.015  # of the range: turns that are nearer than this are equal
    loop_same_time: float = 0.1  # relative: loops that differ in duration by less are equal
    loop_narrowest: float = 0.04  # of the range: narrower loops show nothing
    loop_turn: float = 0.5  # of the narrowest loop: smaller turns of the input are noise
    least_loops: int = 3  # of one kind: two of them have only one difference
    contrast_rounds: int = 4  # of refining the strength
    contrast_first: float = 0.25  # of the first start value of the cause: the first step
    contrast_step: float = 0.1  # of the strength: the later ones
    contrast_hopeless: float = 0.05  # p above which the strength is not refined
    contrast_settled: float = 0.1  # standard errors: a smaller change ends the rounds
    contrast_slope: float = 0.2  # of the strength: the density is smoothed (bench: 0.8 to 1.08)

    # A drift told by the model as given
    slowings: tuple[float, float, int] = (1.0, 100.0, 20)  # falls by 1/e in a record: from, to, how many
    nearer: float = 0.9  # of what a parabola, or a drift alone, leaves (rms): a finer formula must leave less

    # Rivals
    closest: int = 3  # rivals that are refitted
    rival_screened: float = 0.5  # of the gain of the cause found: rivals that score less are not refitted
    rival_gain: float = 0.005  # of that gain: as good, if behind by no more than the largest of this, ...
    rival_relevant: float = 0.3  # ... this share of the relevant fall of squares, ...
    rival_late: float = 0.5  # of what is left above the quick noise: among lags, as good if behind by no more
    fast_steps: float = 5.0  # time steps: what is no slower is as fast as the samples ...
    fast_low: float = 1.1  # ... as is what comes so near to the shortest time that is searched
    fast_share: float = 0.4  # of the part at once: a creep as late as a lag is first tried with so much
    sampled_faster: float = 10.0  # times as often as the record: what its bench may be asked for
    fast_stop: float = 5.0  # such times: by then all but 0.7 % has followed a step
    own_error: float = 1.5  # times what is left: devices of other kinds reach 1.25, true causes fall to 1.54
    once_in_twenty: float = 1.645  # standard deviations of the difference of two fits, by noise as it is
    finer: float = 2.0  # times that doubt: a superfluous parameter would move the others
    cut_turns: float = 0.3  # of the second difference of the output: drawn devices needed up to 0.26
    rival_noise: float = 12.0  # ... and this many mean squares, the noise of comparing two fits
    free_of_weights: float = 0.6  # of a hum in step with the loops: true hums keep 0.8, devices up to 0.56
    alike: float = 0.9  # cosine between screened columns: above it a quick diagnosis names both causes

    # What settles, against heat and steps
    worn: float = 0.02  # share of the output: the first value tried
    worn_within: tuple[float, float] = (0.3, 3.0)  # of the record: the first values tried
    worn_shares: tuple[float, float] = (-0.9, 0.9)  # of the output: beyond these the gain would be gone
    worn_lengths: tuple[float, float] = (0.03, 10.0)  # of the record: faster is creep, slower is straight
    worn_step: float = 0.001  # a small change of either parameter, for differences

    # Intervals
    student: float = 2.26  # 95 % of Student's t with the nine degrees of freedom of ten jackknife parts
    normal: float = 1.96  # 95 % of the normal distribution
    aligned: float = 0.2  # of the discretisation error: this much of it may be in line with a parameter
    moment: float = 0.2  # sample steps: input and output may be read as far apart as this (decision 043)
    of_a_moment: float = 7.35  # -2 log(1 - sqrt(0.95)): the 95 % limit for a moment that was searched for
    farther: float = 1.35  # times the distance to the best moment: the next moment that is tried
    moments_from: float = 0.02  # of the records, at each end: a change nearer to an end has one side only
    moments_moved: int = 3  # times that a moment is moved to a better one

    # Verdict
    unexplained: float = 0.5  # of the reducible part: if more than this is left, the cause is unknown
    unexplained_relevant: float = 4.0  # times the relevant fall of squares: less left is not mentioned ...
    unexplained_span: float = 0.002  # ... nor is less of the span: devices of other kinds leave up to that

    # Records of one input
    same_input: float = 0.02  # of the range, rms: recordings whose inputs differ by less have the same one
    comes_again: float = 0.8  # of what is left beyond noise: with more in both recordings it is the device's

    # A pinched loop
    pinch_groups: int = 51  # of the input's range: in each the distance between the branches is measured
    pinch: float = 0.15  # of the distance on both sides: drawn memristors reach 0.09, others 0.45 or more
    pinch_inside: float = 0.1  # of the input's range: nearer to an end than that is the tip of the loop
    pinch_near: float = 1.5  # of those groups, on either side of the point: whether branches cross there
    pinch_beside: float = 0.02  # of the span, rms: what is narrower than this on both sides is no loop

    # The model as given
    speed_groups: int = 40  # of equal velocity: their mean outputs are compared with the model
    speed_window: int = 9  # samples of the parabola whose slope is the velocity
    poor: float = 0.05  # of the span: a model that leaves less than this is not of the wrong kind
    better: float = 0.75  # of what the model leaves: a function of the velocity must leave less than this
    kind_share: float = 0.1  # of what a function of the velocity leaves: causes leaving less are no repair
    speed_matters: float = 0.6  # of what the direction alone leaves: below it the force is viscous

    # Where the residual is
    rate_edges: tuple[float, ...] = (0.05, 0.3, 1.0, 3.0, 7.0)  # ranges a second; below the first one is rest
    same_rate: float = 1.1  # ratio: groups with nearer medians are one rate that lies on an edge
    rate_s: float = 0.01  # time over which the rate of the input is averaged
    rate_samples: int = 3  # on each side, at least, in that average
    groups: int = 10  # by level, and by time
    told_effect: float = 0.1  # of the span: that a record could have shown a larger effect is no news
    largest_told: float = 100.0  # times the smallest: where that is nothing, the figure says no more
    largest_at: float = 1.5  # times the smallest of the groups: below it the residual is the same everywhere
    welch: int = 4096  # averages in one spectrum
    slow_quantile: float = 0.1  # of the way, or of the time: strokes up to here are slow ...
    fast_quantile: float = 0.9  # ... and from here on they are fast
    one_rate: float = 3.0  # fast over slow: below it the record has one single rate
    least_moving: int = 20  # averages in motion: if there are fewer, rates are not known
    hold_s: float = 0.8  # the shortest rest that is a hold ...
    hold_within: float = 0.02  # ... in which the input stays within this share of its range ...
    hold_noise: float = 10.0  # ... or within so many standard deviations of its noise
    short_s: float = 20.0  # a shorter record is called short
    given_worse: float = 1.8  # times what refitted weights leave: more, if it matters, is reported of it
    no_turn: float = 0.01  # of the range of the input: half the size of the smallest reversal that is a turn
    worth_recording: float = 1.5  # times the difference seen here: an experiment below is not advised
    first_stroke_most: float = 0.25  # of a record: a longer piece is not left out as a first stroke
    first_stroke_missed: float = 3.0  # times what is left of all that follows: more is a first stroke apart
    first_stroke_least: int = 8  # averages: of fewer, noise may be so much larger than that of the others
    first_stroke_share: float = 0.5  # of what causes explain: with more in first strokes, these go

    # Words
    mains_Hz: tuple[float, float] = (50.0, 60.0)  # of all grids except some of railways
    mains_within: float = 0.01  # relative: EN 50160 allows more in half a per cent of a year only
    mains_harmonics: int = 3  # the higher ones lie so close together that any line is near one
    told_digits: int = 3  # significant ones, of widths and parameters
    set_digits: int = 2  # significant ones, of rates and times to be set: 40 s, not 39.9
    plain_digits: int = 6  # before the decimal point: a number with fewer is written without an exponent
    told_to: float = 0.02  # of the range: levels to be set are rounded to the power of ten below this

    # The extended model
    inverse_rounds: int = 16  # of the iteration of the inverse
    inverse_patience: int = 3  # rounds without improvement that end it
    feedback_passes: int = 6  # each reduces the error of an output that is fed back to some per cent
    feedback_settled: float = 1e-9  # of the span: passes end when they change the output by less
    trace_samples: int = 6000  # kept for the figures
    longer: float = 20.0  # times the present length: nobody records for longer to see one cause
    experiment_Hz: float = 200.0  # sample rate of the experiments that are simulated

    # Progress bar only
    search_begins: float = 0.15  # share of the work: done before the search
    search_share: float = 0.5  # share of the work: the search
    search_round: float = 0.6  # share of the search that is left after each round


LIMITS = Thresholds()

# Not thresholds but mathematics.
TINY = 1e-300  # keeps a division by nothing finite
PERCENT = 100.0
CHI_SQUARE_MEDIAN = 0.4549  # median of the square of a standard normal variable
NORMAL_MAD = 0.6745  # median of |x| of a standard normal variable
DIFFERENCES = 3  # third ones: a smooth output hardly has any
THIRD_DIFFERENCE = 20.0  # 1 + 9 + 9 + 1: their variance for white noise
THIRD = 1 / 3  # of an octave: bands of a spectrum
UNIFORM = 12.0  # a step q spreads its error evenly: variance q^2 / 12
