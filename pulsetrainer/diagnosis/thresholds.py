"""Every number that decides something in a diagnosis; those of one cause are in the file of that cause.

Where a line names no other origin, the number was set on the tuning seeds of docs/blind.md (4242, 7000 to
7302, 500000 to 500109) and then frozen; the grids of that page judged it on other seeds.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The numbers of the procedure; each line says what the number guards."""

    # The units of a record: its own second, see ``scale``; all times below are in it
    path_piece: float = 0.05  # ranges of the input: pieces of its path whose times are compared
    crossings: float = 4.286  # of the range in one second: the diagnostic signal's, on which all was tuned
    most_seconds: float = 3000.0  # of all records: with more the input hardly moves, and has no typical rate
    span_quantiles: tuple[float, float] = (0.001, 0.999)  # of the output, that its span lies between

    # Preparing a record
    fastest_Hz: float = 1000.0  # samples a second: faster records are averaged down ...
    most_samples: int = 20_000  # ... but to no fewer samples than these
    least_samples: int = 100  # of a record: fewer can be followed by any cause
    even_within: float = 0.1  # time steps: stamps that near to even ones are even
    gap_steps: float = 1.5  # usual time steps: a longer one is a gap, whose filled samples do not count
    usual_of: int = 31  # neighbouring time steps, whose median is the usual one: rates differ within a record
    most_even: int = 2_000_000  # even steps that a record is brought to
    least_present: float = 0.5  # share of a record's even steps that must be there
    beyond_range: float = 0.02  # of the model's range: input farther out lies outside it
    least_inside: float = 0.5  # share of the input: with less inside it is another device
    bin_s: float = 0.005  # length of an average: short enough for a resonance of 70 Hz ...
    enough_rows: int = 4000  # ... and for so many averages, where there are as many samples
    rows_at_once: int = 2000  # turned from nodes to cells: more take more memory, and no less time
    most_rows: int = 20_000  # averages: longer records get longer averages, so that the fit fits in memory
    short_filter: int = 60  # averages: a lag that forgets within so many leaves the rows of a fit sparse
    least_rows: int = 100  # averages: fewer tell no causes apart
    start_tau_s: tuple[float, ...] = (0.2, 0.8, 3.2)  # decays fitted from a record's start (decision 040)
    start_share: float = 6.0  # time constants of such a decay that a record must hold: else it is an offset
    bulk_of_values: tuple[float, float] = (0.1, 0.9)  # quantiles of distinct values: no wild one is between
    same_value: float = 1e-9  # of the span: outputs nearer than this are one value, rounded
    jump_of_input: float = 0.1  # of its range from one sample to the next: there the output jumps as well
    noise_least: int = 8  # third differences: fewer tell no noise
    folded: float = 0.4  # periods of a hum in an average: with half a one it is seen at another frequency
    line_around: int = 100  # lines of the spectrum on each side of a hum, of whose median ...
    line_stands: float = 10.0  # ... it is so many times: of 100 000 lines of noise the highest has 4.1
    line_share: float = 0.5  # of the squares of these: one line with more is a hum, and no noise ...
    line_samples: int = 1000  # ... of so many: of fewer one line has much by chance
    line_wide: int = 3  # lines on each side that a window spreads it over
    coarse_reading: float = 0.004  # of the input's range: finer steps of its reading hurt no fit
    least_held: int = 100  # readings that stay between two steps the same way: fewer tell nothing
    read_evenly: float = 0.5  # of an even motion, while the reading stays: such an output saw no steps
    not_between: float = 0.5  # of a coarse step of the input: so much is not known beside turns and rests
    coarse_noise: float = 1.8  # times the noise, with its own: of steps of 2 sigma 0.7 % does not average out
    steps_apart: float = 2.5  # coarse steps: jumps of fewer are those steps
    state: float = 0.15  # of the span: values farther apart are states of a device that switches

    # Static fit
    levels: int = 32  # of the plane on which causes are sought: finer ones take longer and decide the same
    coarse_levels: int = 22  # of the plane that shows how the discretisation error falls with the cell
    smoothing: float = 0.035  # of the density, share of the range: holds the fit at the levels above
    near_end: float = 0.01  # of the range: the outputs at its two ends are averaged over so much
    shown_kept: int = 12  # outputs kept of what chains begin with, at the full rate
    followed_kept: int = 10  # inputs kept as they were followed through the plane: some 10 MB each
    ridge: float = 1e-10  # of the largest diagonal entry: keeps the factor of the positive cells regular
    rounding: float = 1e-12  # of a sum of squares: what a difference of two such leaves, and no variation
    ridge_held_out: float = 1e-9  # relative: the same where blocks are left out
    ridge_steps: float = 1e-9  # relative: the same for the step of the parameters

    # Joint refit
    refit_rounds: int = 6  # Gauss-Newton steps of a refit
    trial_rounds: int = 3  # of a candidate: ranks it; the accepted one gets a full refit
    rival_rounds: int = 2  # of a rival: shows whether it comes close
    without_rounds: int = 1  # of a model that a cause was taken from: the others move little
    passes: int = 8  # at most, of the weights against what the output causes add (decision 041)
    passes_settled: float = 0.05  # change of what they add, of the residual: below, the passes end
    hopeless: float = 4.0  # times its last fall: a refit that is further from its goal is given up
    enough: float = 2e-3  # relative fall of the sum of squares: below, the refit ends
    difference: float = 0.02  # of a parameter's value: step of its derivative, if larger than the cause's own
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
    octaves: int = 6  # in which it is looked at: 1.6 Hz and faster
    least_quiet: int = 800  # averages at rest: with fewer the slowest ones are looked at
    slowest: float = 0.3  # of the averages: those
    slope_octaves: int = 3  # the slowest of the octaves, from which what is slower still is continued
    steepest: float = 1.2  # power of the period with which a spectrum may rise: pink noise has 1
    trimmed: float = 0.05  # of the averages of a band: the largest are no noise
    trimmed_moving: float = 0.5  # the same where nothing rests: there the model errs more
    impulse: float = 3.5  # standard deviations: an average farther out ...
    alone: float = 2.0  # ... and so many times larger than its neighbours is of a heavy tail
    slow_doubt: float = 4.0  # times what the continuation gives: slow errors no larger than that are noise

    # Screening and its null
    p_max: float = 0.01  # over the whole library: the false alarms that a search may make in a hundred
    nine_of_ten: float = 1.2816  # standard deviations of noise that nine of ten effects are sure against
    halves: tuple[float, float, int] = (1.0, 200.0, 4000)  # half squares among which a line's limit is sought
    slow_noise: float = 3.0  # times the noise from sample to sample: averages with more have slow noise
    burstiness: float = 4.5  # kurtosis in octaves: drawn noises have 2.9 to 4, bursts and loads 5.5 to 8
    bursts_span: float = 0.004  # of the span: plants of other kinds leave less that comes in bursts
    matters: float = 0.005  # of the span: so much must show, or nothing can be said; by convention
    draws: int = 1999  # of the noise: the smallest p is a twentieth of the limit
    probes: int = 12  # white signals that tell how much of a spectrum the weights and the library take away
    band: float = 1.15  # of its frequency: width of a band of the noise's spectrum ...
    least_lines: int = 4  # ... which has at least so many lines
    median_lines: int = 12  # a band of so many is a median: a line of a hum is no noise
    least_seen: float = 0.2  # of a probe: a band that keeps less of it says nothing
    least_left: float = 0.05  # of a probe, or of the largest noise: keeps ratios finite
    visible: float = 1e-6  # of a column: less than that left by the weights is rounding
    rank: float = 1e-3  # of the largest singular value: smaller ones of the library's columns are noise
    start_falls: float = 0.2  # a linearised strength starts a refit within this ...
    start_rises: float = 5.0  # ... and this factor of the value that was tried

    # Accepting a cause
    most_causes: int = 5  # at once: more has never been right
    tried: int = 3  # candidates refitted in each round
    linearised: float = 0.5  # of what a refit gains: a linearised score shows at least so much (decision 044)
    nearly: float = 0.75  # of the relevant fall: a candidate that gains so much is refitted to its end first
    held_out_least: float = 0.05  # of the reducible part: a smaller fall of the held-out error is no gain
    held_out_kept: float = 0.33  # of that part: on foreign plants true causes reach 0.43, false ones 0.28
    half: float = 0.5  # of that part: steps of foreign plants reach 0.55, what is none there 0.44
    least_share: float = 0.002  # of what all causes explain: less is what the formulas of the others miss
    blocks: int = 20  # of a record, cut where its memory is wiped out
    jackknife: int = 10  # parts left out in turn for the intervals
    rows_per_unknown: int = 2  # averages that must stay for each unknown when blocks are left out
    start_kept: float = 0.01  # of a column's squared norm: holds a start whose block is left out

    # Repetition
    pieces: int = 5  # whole ones, of the time, each predicted from the others
    rates: int = 4  # groups of blocks by their rate, each predicted from the others
    repeated: float = 0.5  # of what the fit gains: a smaller gain on the pieces is chance
    mends: float = 0.1  # of what can be explained: less, of a strength that may be nothing, is not found
    held_by_the_rest: float = 0.035  # of a fault's squares: foreign plants leave up to 0.035, true ones 0.039
    even_drift: float = 4.0  # mean square of a drift that goes on evenly from zero, over its variance
    predicts_though_held: float = 0.8  # of the reducible held-out error: true drifts, though held, 0.85
    told_though_held: float = 0.001  # of the span, rms: a fault that is held and explains more is spoken of
    piece_worse: float = 0.1  # of that gain: no piece may be predicted worse by more
    piece_told: float = 0.02  # weight of a piece that is left out: enough where the others tell nothing
    wander_pieces: int = 10  # of the time: a gain and an offset of each show that the record wanders ...
    wander_left: float = 0.33  # ... if they take away so much of what is left (true drifts: up to 0.15) ...
    wander_fall: float = 0.1  # ... and so much of what a drift took away
    wander_knots: int = 16  # of a zero that follows the time: it turns every twelfth of a record at most
    gain_in_use: float = 0.6  # of what causes gain in the search: true ones keep 0.68 and more
    begin_share: float = 0.2  # of a record: what went on before it has decayed by then
    settled_times: float = 5.0  # of the longest time constant: a rest after which 0.7 % is still under way
    slow_share: float = 0.4  # of what is left: so much that may be slow noise is sought in the bank too

    # Unlisted
    as_well: float = 0.7  # of what the best state predicts: the same of the gain, or of the output, is tried
    other_tau: float = 1.5  # of the time constant: two of one state that are nearer are the same
    most_states: int = 3  # learned one after another
    learned_rounds: int = 4  # Gauss-Newton steps of the joint refit with each
    fastest_state_s: float = 0.05  # time constants of the bank from here: what is faster mends a lag ...
    nearly_all: float = 0.9  # of what a curve in their place explains: listed causes that do keep their names
    learned_predicts: float = 0.75  # of the reducible held-out error: what is only imitated reaches 0.7
    imperfect: float = 0.08  # of what listed causes explain: so much their formulas may miss
    slowest_state: float = 0.25  # ... to this share of the longest record ...
    state_ratio: float = 2.0  # ... so far apart; the best is refined within that factor ...
    bank_draws: int = 299  # of the noise, each scored on the whole bank: p is at least a third of the limit
    state_settled: float = 0.02  # ... to this relative error
    state_ends: tuple[float, float] = (0.002, 0.998)  # quantiles between which a curve is drawn
    curve_ridge: float = 1e-3  # of the mean square of a curve's columns: holds its second differences
    curve_places: int = 41  # of the figure of a curve
    curve_bulk: tuple[float, float] = (0.02, 0.98)  # quantiles of the state: beyond, a record shows little

    # Equal loops (decision 042)
    contrast_p_max: float = 0.001  # the second of two tests: at 0.005 it alarmed in 3 of 141 controls
    permutations: int = 1999  # of equal loops: the smallest p is half of the limit
    loop_places: int = 12  # averages along each branch
    loop_same: float = 0.015  # of the range: turns that near are equal
    loop_same_time: float = 0.1  # relative: loops that took as long are equal
    loop_narrowest: float = 0.04  # of the range: narrower loops say nothing
    loop_turn: float = 0.5  # of the narrowest loop: smaller turns of the input are noise
    least_loops: int = 3  # of one kind: two have one difference only
    contrast_rounds: int = 4  # of the strength
    contrast_first: float = 0.25  # of the cause's first start: the first step
    contrast_step: float = 0.1  # of the strength: the later ones
    contrast_hopeless: float = 0.05  # p above which the strength is not refined
    contrast_settled: float = 0.1  # standard errors: a smaller change ends the rounds
    contrast_slope: float = 0.2  # of the strength: the density is smoothed (bench: 0.8 to 1.08)

    # A drift told by the model as given
    slowings: tuple[float, float, int] = (1.0, 100.0, 20)  # falls by 1/e in a record, from, to, and how many
    nearer: float = 0.9  # of what a parabola, or a drift alone, leaves (rms): what is put in leaves less

    # Rivals
    closest: int = 3  # rivals refitted
    rival_screened: float = 0.5  # of the found cause's gain: rivals that score less are not refitted
    rival_gain: float = 0.005  # of that gain: as good, if no farther behind than the largest of this,
    rival_relevant: float = 0.3  # ... of the relevant fall of squares,
    rival_late: float = 0.5  # of what is left above the quick noise: as good, among lags
    quick_steps: float = 5.0  # time steps: what is no slower is as quick as the samples ...
    quick_low: float = 1.1  # ... as is what comes so near to the shortest time that is searched
    quick_share: float = 0.4  # of the part at once: a creep as late as a lag is first tried with so much
    quick_stop: float = 5.0  # such times: by then all but 0.7 % has followed a step
    own_error: float = 1.5  # times what is left: other kinds of plant reach 1.25, true causes fall to 1.54
    once_in_twenty: float = 1.645  # standard deviations of their difference under noise as it is
    finer: float = 2.0  # times that doubt: a parameter that is not there would move the others
    cut_turns: float = 0.3  # of the second difference of the output: drawn plants needed up to 0.26
    rival_noise: float = 12.0  # ... and mean squares: the noise of comparing two fits
    free_of_weights: float = 0.6  # of a hum in step with the loops: true ones have 0.8, devices up to 0.56
    alike: float = 0.9  # cosine of screened columns: above, a quick screen names both

    # What settles, against heat and steps
    worn: float = 0.02  # share of the output, tried first
    worn_within: tuple[float, float] = (0.3, 3.0)  # of the record, tried first
    worn_shares: tuple[float, float] = (-0.9, 0.9)  # of the output: a gain that is gone is no gain
    worn_lengths: tuple[float, float] = (0.03, 10.0)  # of the record: faster is creep, slower straight
    worn_step: float = 0.001  # of either, that matters little: for differences

    # Intervals
    student: float = 2.26  # 95 % of Student's t with the nine degrees of freedom of ten jackknife parts
    normal: float = 1.96  # 95 % of the normal distribution
    aligned: float = 0.2  # of the discretisation error: how far it may be in line with a parameter
    moment: float = 0.2  # sample steps: how far input and output may be apart (decision 043)
    of_a_moment: float = 7.35  # -2 log(1 - sqrt(0.95)), for a moment that was searched for
    farther: float = 1.35  # times as far from the best moment is the next one tried
    moments_from: float = 0.02  # of the records, at each end: what happens there has one side only
    moments_moved: int = 3  # times a moment is moved to a better one

    # Verdict
    unexplained: float = 0.5  # of the reducible part: with more left the cause is unknown
    unexplained_relevant: float = 4.0  # times the relevant fall of squares: less left is not worth a word ...
    unexplained_span: float = 0.002  # ... nor is less of the span: plants of other kinds leave up to that

    # A pinched loop
    pinch_groups: int = 51  # of the input's range, in each of which the branches are as far apart as they are
    pinch: float = 0.15  # of their distance on both sides: drawn memristors have up to 0.09, others from 0.45
    pinch_near: float = 1.5  # of those groups: on either side of the point, whether branches cross there
    pinch_beside: float = 0.02  # of the span, rms: what is narrower on both sides is no loop

    # The model as given
    speed_groups: int = 40  # of equal velocity, whose mean outputs stand against the model
    speed_window: int = 9  # samples of the parabolas whose slope is the velocity
    poor: float = 0.05  # of the span: a model that leaves less is not of the wrong kind
    better: float = 0.75  # of what the model leaves: a function of velocity must leave less to win
    speed_matters: float = 0.6  # of what the direction leaves: below, the force is viscous

    # Where the residual is
    rate_edges: tuple[float, ...] = (0.05, 0.3, 1.0, 3.0, 7.0)  # ranges a second; below the first is rest
    same_rate: float = 1.1  # times: groups whose medians are closer are one rate that lies on an edge
    rate_s: float = 0.01  # over which the rate of the input is averaged
    rate_samples: int = 3  # on each side, at least, of that mean
    groups: int = 10  # of level and of time
    largest_at: float = 1.5  # times the least of its groups: below, the residual is the same everywhere
    welch: int = 4096  # averages in one spectrum
    slow_quantile: float = 0.1  # of the way, or of the time: strokes up to here are slow ...
    fast_quantile: float = 0.9  # ... and from here on fast
    one_rate: float = 3.0  # fast over slow: below, the record has one single rate
    least_moving: int = 20  # averages in motion: fewer have no rates
    hold_s: float = 0.8  # a rest must last so long to be a hold ...
    hold_within: float = 0.02  # ... in which the input stays within this share of its range ...
    hold_noise: float = 10.0  # ... or within so many standard deviations of its noise
    short_s: float = 20.0  # a shorter record is called short
    given_worse: float = 2.5  # times what refitted weights leave: more is told of the model as given
    no_turn: float = 0.01  # of the range of the input: half of the smallest wiggle that is a turn
    worth_recording: float = 1.5  # times as far apart as here: an experiment that gains less is not advised
    first_stroke_most: float = 0.25  # of a record: more is no first stroke, and is not given up for one

    # Words
    mains_Hz: tuple[float, float] = (50.0, 60.0)  # of all grids, but for railways
    mains_within: float = 0.01  # of them: what EN 50160 allows in all but half a per cent of a year
    mains_harmonics: int = 3  # of higher ones so many lie close together that any line is near one
    told_digits: int = 3  # significant, of rates and widths
    plain_digits: int = 6  # a number of fewer digits before its point is told without an exponent
    told_to: float = 0.02  # of the range: levels to be set are told to the power of ten below

    # The extended model
    inverse_rounds: int = 16  # of the inverse
    inverse_patience: int = 3  # rounds without gain that end it
    feedback_passes: int = 6  # each multiplies the error of a fed back output by some per cent
    feedback_settled: float = 1e-9  # of the span: passes end when they change less
    trace_samples: int = 6000  # kept for the figures
    longer: float = 20.0  # times as long as it was: nobody records for longer to see one cause
    experiment_Hz: float = 200.0  # sample rate of the experiments tried on paper

    # Progress bar only
    search_begins: float = 0.15  # share of the work that is done before the search
    search_share: float = 0.5  # of the work
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
