#include "control.h"

#include <stddef.h>

#include "hal.h"
#include "units.h"

/* The host counts the duty in the same unit. */
typedef char control_duty_unit[HAL_PWM_PERIOD == PT_DUTY_FULL ? 1 : -1];

struct control control;

/* On the way down no gain is stronger than the compiled one, whatever a host has chosen for its run; a weaker one
 * stays: on a coil of less inductance, or at a higher supply, the compiled ones would ring. */
static const struct pid_gains own_gains = {
    .kp = PT_DEFAULT_PID_KP,
    .ki = PT_DEFAULT_PID_KI,
    .feed_resistance = PT_DEFAULT_FEED_RESISTANCE,
    .feed_inductance = PT_DEFAULT_FEED_INDUCTANCE,
    .feed_offset = PT_DEFAULT_FEED_OFFSET,
};

static bool read_sensors(void)
{
    struct hal_adc adc;
    bool fresh = hal_adc_read(&adc);
    control.now.current_counts = adc.current;
    control.now.force_counts = adc.force;
    control.now.current_100uA = units_current(adc.current);
    control.now.force_mN = units_force(adc.force);
    return fresh;
}

void control_init(void)
{
    hal_pwm_kill();
    control.now = (struct safety_input){0};
    control.now.full_counts = HAL_PWM_PERIOD;
    (void)read_sensors();
    control.state = PT_STATE_IDLE;
    control.fault = PT_FAULT_NONE;
    control.worst = PT_FAULT_NONE;
    control.snapshot = (struct control_snapshot){0};
    control.tick = 0;
    control.session = 0;
    control.in_tick = false;
    control.nested = false;
    control.ticked = false;
    control.slew_100uA_per_tick = 0;
    wave_reset(&control.wave);
    control.pid.gains = own_gains;
    control.ramp_gains = own_gains;
    pid_reset(&control.pid);
    safety_init(&control.safety, hal_kept(), hal_reset_cause() == PT_RESET_POWER, control.now.force_mN);
    telemetry_init(&control.telemetry);
}

/* --- states: in the tick, or in a critical section ---------------------------------------------- */

static void output_off(void)
{
    hal_pwm_kill();
    control.now.duty_counts = 0;
    control.now.reference_100uA = 0;
    pid_reset(&control.pid);
    wave_forget(&control.wave); /* a new run needs a new upload and a new ARM */
}

static void begin_session(void)
{
    control.session++;
    control.tick = 0;
    wave_start(&control.wave);
    telemetry_begin(&control.telemetry, control.session);
    safety_alive(&control.safety);
    hal_pwm_set(0);
    hal_pwm_enable();
}

/* The only place where the state changes, and where the output is switched on. False: it was not `from`, or a
 * latched fault forbids `to`. */
static bool transition(uint8_t from, uint8_t to)
{
    bool drives = to == PT_STATE_ARMED || to == PT_STATE_RUNNING;
    if (control.state != from || (drives && control.fault != PT_FAULT_NONE))
        return false;
    if (from == PT_STATE_RUNNING)
        telemetry_end(&control.telemetry);
    switch (to) {
    case PT_STATE_ARMED:
        pid_reset(&control.pid);
        break;
    case PT_STATE_RUNNING:
        begin_session();
        break;
    case PT_STATE_RAMPING:
        control.pid.gains = control.ramp_gains;
        break;
    default:
        output_off();
        break;
    }
    control.state = to;
    return true;
}

static void latch(uint8_t fault)
{
    if (fault == PT_FAULT_NONE)
        return;
    if (safety_gravity(fault) > safety_gravity(control.worst))
        control.worst = fault;
    if (control.fault != PT_FAULT_NONE)
        return;
    control.fault = fault;
    control.snapshot.tick = control.tick;
    control.snapshot.reference_100uA = control.now.reference_100uA;
    control.snapshot.current_100uA = control.now.current_100uA;
    control.snapshot.force_mN = control.now.force_mN;
    control.snapshot.duty_counts = control.now.duty_counts;
    control.snapshot.state = control.state;
}

/* In every tick: what is latched has its way, whoever latched it and in whatever state that was. */
static void obey_latch(void)
{
    if (control.worst == PT_FAULT_NONE || control.state == PT_STATE_FAULT)
        return;
    if (safety_gravity(control.worst) == SAFETY_RAMPS &&
        (control.state == PT_STATE_RAMPING || transition(PT_STATE_RUNNING, PT_STATE_RAMPING)))
        return;
    (void)transition(control.state, PT_STATE_FAULT);
}

/* --- the tick ----------------------------------------------------------------------------------- */

static bool is_driving(void)
{
    return control.state == PT_STATE_RUNNING || control.state == PT_STATE_RAMPING;
}

/* What the waveform asks of this tick, before the slew limit. */
static int16_t asked_reference(uint8_t *fault, bool *last)
{
    int16_t asked = 0;
    enum wave_result result = wave_tick(&control.wave, &asked);
    *last = result == WAVE_LAST;
    if (result == WAVE_UNDERRUN)
        *fault = PT_FAULT_UNDERRUN;
    if (control.wave.corrupt)
        *fault = PT_FAULT_WAVE_CRC;
    return asked;
}

static int16_t slew(int16_t from, int16_t to, bool *limited)
{
    int16_t limit = control.slew_100uA_per_tick;
    int32_t change = (int32_t)to - from;
    if (change > limit || change < -limit) {
        *limited = true;
        change = change > 0 ? limit : -limit;
    }
    return (int16_t)(from + change);
}

static int16_t ramp(int16_t from)
{
    return (int16_t)(from > CONTROL_RAMP_100UA_PER_TICK ? from - CONTROL_RAMP_100UA_PER_TICK : 0);
}

/* What the tick itself finds wrong, gravest first. */
static uint8_t find_fault(const struct safety_input *in, bool fresh, uint8_t of_wave)
{
    uint8_t fault = safety_tick(&control.safety, in);
    bool lost = hal_tick_lost(); /* asked in every tick: each tells once */
    bool overrun = hal_tick_overrun();
    if ((lost || overrun || !fresh) && in->armed && safety_gravity(fault) <= SAFETY_RAMPS)
        return fresh ? PT_FAULT_TICK_OVERRUN : PT_FAULT_CONVERTER; /* control_watch() sees to a tick that stays away */
    return fault != PT_FAULT_NONE ? fault : of_wave;
}

static void drive(void)
{
    if (!is_driving()) {
        hal_pwm_kill();
        control.now.duty_counts = 0;
        return;
    }
    struct safety_input *now = &control.now;
    now->duty_counts = pid_step(&control.pid, now->reference_100uA, now->current_100uA, HAL_PWM_PERIOD);
    hal_pwm_set(now->duty_counts);
    if (now->reference_100uA == 0 && control.state == PT_STATE_RAMPING)
        (void)transition(PT_STATE_RAMPING, control.fault != PT_FAULT_NONE ? PT_STATE_FAULT : PT_STATE_IDLE);
}

static void step(void)
{
    bool fresh = read_sensors();
    struct safety_input *now = &control.now;
    uint8_t state = control.state;
    bool running = state == PT_STATE_RUNNING;
    now->driving = running || state == PT_STATE_RAMPING;
    now->awaited = running || state == PT_STATE_ARMED;
    now->armed = now->driving || now->awaited;
    now->comparator = hal_comparator();
    uint8_t of_wave = PT_FAULT_NONE;
    bool last = false;
    if (running) {
        bool limited = false;
        int16_t asked = asked_reference(&of_wave, &last);
        now->reference_100uA = slew(now->reference_100uA, asked, &limited);
        struct telemetry_sample *sample = telemetry_tick(&control.telemetry, limited);
        if (sample != NULL) {
            sample->tick |= control.tick;
            sample->reference = asked;
            sample->current = now->current_100uA;
            sample->force = now->force_mN;
            sample->duty = now->duty_counts;
        }
    } else {
        now->reference_100uA = ramp(now->reference_100uA);
    }
    latch(find_fault(now, fresh, of_wave));
    obey_latch();
    if (last)
        (void)transition(PT_STATE_RUNNING, PT_STATE_RAMPING);
    drive();
    if (running)
        control.tick++;
}

void control_tick(void)
{
    if (control.in_tick) { /* this interrupt broke into itself: the other one sees to the rest */
        hal_pwm_kill();
        control.nested = true;
        return;
    }
    control.in_tick = true;
    step();
    if (control.nested) {
        control.nested = false;
        latch(PT_FAULT_TICK_OVERRUN);
        obey_latch();
    }
    control.ticked = true;
    control.in_tick = false;
}

/* --- the main loop ------------------------------------------------------------------------------ */

void control_watch(void)
{
    bool lost = hal_tick_lost();
    hal_critical_enter();
    heat_keep(&control.safety.heat);
    if (lost && (is_driving() || control.state == PT_STATE_ARMED)) {
        latch(PT_FAULT_TICK_LOST);
        obey_latch();
    }
    hal_critical_exit();
}

bool control_is_alive(void)
{
    bool was = control.ticked;
    control.ticked = false;
    return was;
}

static uint8_t must_be_idle(void)
{
    if (control.fault != PT_FAULT_NONE)
        return PT_NAK_CODE_FAULT;
    return control.state == PT_STATE_IDLE ? 0u : PT_NAK_CODE_STATE;
}

uint8_t control_wave_begin(uint32_t total, uint16_t ticks_per_sample, uint32_t crc)
{
    hal_critical_enter();
    uint8_t refused = must_be_idle();
    if (!refused)
        wave_begin(&control.wave, total, ticks_per_sample, crc);
    hal_critical_exit();
    return refused;
}

uint8_t control_wave_publish(uint8_t count)
{
    hal_critical_enter();
    uint8_t refused = control.wave.begun ? 0u : PT_NAK_CODE_STATE; /* the run may have ended meanwhile */
    if (!refused) {
        wave_publish(&control.wave, count);
        safety_alive(&control.safety);
    }
    hal_critical_exit();
    return refused;
}

uint8_t control_wave_commit(uint32_t count, uint32_t crc)
{
    hal_critical_enter();
    uint8_t refused = must_be_idle();
    if (!refused && (!control.wave.begun || control.wave.received == 0))
        refused = PT_NAK_CODE_STATE;
    if (!refused && (count != control.wave.received || crc != control.wave.crc))
        refused = PT_NAK_CODE_CRC;
    if (!refused)
        control.wave.committed = true;
    hal_critical_exit();
    return refused;
}

/* While an open-ended wave is played: is what has arrived what was sent? If not, the tick ramps down. */
uint8_t control_wave_check(uint32_t count, uint32_t crc, bool end)
{
    hal_critical_enter();
    uint8_t refused = 0;
    if (control.state != PT_STATE_RUNNING)
        refused = PT_NAK_CODE_STATE;
    else if (count != control.wave.received)
        refused = PT_NAK_CODE_OFFSET;
    else if (crc != control.wave.crc)
        control.wave.corrupt = true;
    else if (end && !wave_end(&control.wave))
        refused = PT_NAK_CODE_STATE;
    hal_critical_exit();
    return refused;
}

void control_wave_forget(void)
{
    hal_critical_enter();
    wave_forget(&control.wave);
    hal_critical_exit();
}

static int32_t lesser(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static struct pid_gains no_stronger_than_own(const struct pid_gains *g)
{
    const struct pid_gains gains = {
        .kp = lesser(g->kp, own_gains.kp),
        .ki = lesser(g->ki, own_gains.ki),
        .feed_resistance = lesser(g->feed_resistance, own_gains.feed_resistance),
        .feed_inductance = lesser(g->feed_inductance, own_gains.feed_inductance),
        .feed_offset = lesser(g->feed_offset, own_gains.feed_offset),
    };
    return gains;
}

static uint8_t arm(const struct control_settings *settings)
{
    if (control.state == PT_STATE_ARMED)
        return 0; /* a wire that repeats itself may bring ARM once more: nothing to do */
    uint8_t refused = must_be_idle();
    if (refused)
        return refused;
    if (!control.wave.committed)
        return PT_NAK_CODE_STATE;
    latch(safety_before_arm(&control.safety));
    obey_latch();
    if (!transition(PT_STATE_IDLE, PT_STATE_ARMED))
        return PT_NAK_CODE_FAULT;
    control.pid.gains = settings->gains;
    control.ramp_gains = no_stronger_than_own(&settings->gains);
    control.slew_100uA_per_tick = settings->slew_100uA_per_tick;
    safety_begin(&control.safety, &settings->limits);
    return 0;
}

uint8_t control_arm(const struct control_settings *settings)
{
    hal_critical_enter();
    uint8_t refused = arm(settings);
    hal_critical_exit();
    return refused;
}

uint8_t control_start(void)
{
    hal_critical_enter();
    uint8_t refused = 0; /* a repeated START finds it running: nothing to do */
    if (control.state != PT_STATE_RUNNING && !transition(PT_STATE_ARMED, PT_STATE_RUNNING))
        refused = control.state == PT_STATE_ARMED ? PT_NAK_CODE_FAULT : PT_NAK_CODE_STATE;
    hal_critical_exit();
    return refused;
}

void control_stop(void)
{
    hal_critical_enter();
    if (!transition(PT_STATE_RUNNING, PT_STATE_RAMPING) && !transition(PT_STATE_ARMED, PT_STATE_IDLE) &&
        control.state == PT_STATE_IDLE)
        wave_forget(&control.wave);
    hal_critical_exit();
}

uint8_t control_clear(uint8_t fault, uint8_t worst)
{
    hal_critical_enter();
    uint8_t refused = 0; /* it is cleared already */
    if (control.fault != PT_FAULT_NONE) {
        if (control.state != PT_STATE_FAULT)
            refused = PT_NAK_CODE_STATE; /* it has not had its way yet */
        else if (fault != control.fault || worst != control.worst)
            refused = PT_NAK_CODE_FAULT; /* not what the host has seen */
        else
            (void)transition(PT_STATE_FAULT, PT_STATE_IDLE);
    }
    if (!refused) {
        control.fault = PT_FAULT_NONE;
        control.worst = PT_FAULT_NONE;
        control.snapshot = (struct control_snapshot){0};
    }
    hal_critical_exit();
    return refused;
}

uint8_t control_coil_heat(uint16_t per_mille)
{
    hal_critical_enter();
    uint8_t refused = 0;
    if (control.state != PT_STATE_IDLE && control.state != PT_STATE_FAULT)
        refused = PT_NAK_CODE_STATE;
    else if (!heat_tell(&control.safety.heat, per_mille))
        refused = PT_NAK_CODE_RANGE;
    hal_critical_exit();
    return refused;
}
