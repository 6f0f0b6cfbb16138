/* Device time against the wall clock.
 *
 * --speed real: ticks follow the wall clock, armed or not.
 * --speed steady: as max, but never ahead of the wall clock: for a person at the keys, on a computer that may be busy.
 * --speed max: device time runs as fast as computer and link allow, which must not cheat the safety of
 * the device nor a host that is merely slow:
 *   - disarmed, time stands still once the coil has settled: nothing can happen, and two equal captures
 *     give equal numbers however long the pauses between them were;
 *   - armed but not started, and while playing whenever the host has been silent for half the
 *     heartbeat (100 ms of device time), the reference is about to run dry, or telemetry waits for a slow reader, time stands still,
 *     for at most two seconds of wall time after the last heartbeat, and five in all; after that it
 *     goes on at the wall clock, so that a host that is really gone trips the 200 ms heartbeat like on a real device,
 *     and one that lives but sends no more samples an underrun.
 * Wall time in which this process itself did not run is no silence of the host: both were asleep.
 * A coil that has tripped its heat model cools only while time runs: open a new bench instead of waiting. */
#include "commands.h"
#include "control.h"
#include "port.h"

#define NS_PER_TICK 100000
#define BATCH 10                    /* ticks between two looks at the pty */
#define TELEMETRY_HIGH 48           /* waiting samples: the reader is behind */
#define SETTLE_TICKS 2000           /* after the output went off; less than the watchdog waits */
#define GRACE_NS 2000000000         /* wall time that a stalled device waits for its host: longer than a busy computer keeps one off */
#define PATIENCE_NS 3000000000      /* the same for one that beats, but has nothing to play */
#define CATCH_UP_NS 50000000        /* a computer that was busy: what is lost is lost, or the host looks silent */
#define LOOK_MS 20                  /* a stalled device looks at the clock this often; less than CATCH_UP_NS */

static enum pace_speed speed;
static int64_t epoch_ns;       /* real: when tick 0 was due; max: since when device time has been stalled */
static int64_t epoch_ticks;    /* ticks run since then */
static bool stalled;
static uint32_t heard;         /* the last heartbeat while stalled */
static int64_t stalled_ns;     /* since when */
static int64_t looked_ns;      /* max: when the clock was last read */
static int32_t settle_ticks;
static int64_t next_ns;        /* steady: until then no tick runs */

void pace_init(enum pace_speed chosen, int64_t now_ns)
{
    speed = chosen;
    epoch_ns = now_ns;
    epoch_ticks = 0;
    stalled = false;
    heard = 0;
    stalled_ns = now_ns;
    looked_ns = now_ns;
    settle_ticks = 0;
    next_ns = now_ns;
}

static bool output_off(void)
{
    return control.state == PT_STATE_IDLE || control.state == PT_STATE_FAULT;
}

/* Ticks that the wall clock has made due since epoch_ns. */
static int32_t due(int64_t now_ns)
{
    int64_t ticks = (now_ns - epoch_ns) / NS_PER_TICK - epoch_ticks;
    if (ticks <= 0)
        return 0;
    int32_t n = ticks < BATCH ? (int32_t)ticks : BATCH;
    epoch_ticks += n;
    return n;
}

static int32_t real_ticks(int64_t now_ns)
{
    int64_t behind_ns = now_ns - epoch_ns - epoch_ticks * NS_PER_TICK;
    if (behind_ns > CATCH_UP_NS)
        epoch_ns += behind_ns;
    return due(now_ns);
}

static bool must_wait(void)
{
    switch (control.state) {
    case PT_STATE_RUNNING:
        if (board_hangs()) /* nobody to wait for: the watchdog has to see time pass */
            return false;
        /* By commands, not by bytes: a damaged one must not let the rest of the heartbeat run off. */
        return control.safety.silent_ticks >= control.safety.limits.heartbeat_ticks / 2 || wave_ticks_left(&control.wave) < 2 * BATCH ||
               telemetry_waiting(&control.telemetry) >= TELEMETRY_HIGH;
    case PT_STATE_ARMED:
        return true;
    default:
        return false;
    }
}

static void leave_out_time_asleep(int64_t now_ns)
{
    int64_t asleep_ns = now_ns - looked_ns;
    looked_ns = now_ns;
    if (!stalled || asleep_ns <= CATCH_UP_NS)
        return;
    epoch_ns += asleep_ns;
    stalled_ns += asleep_ns;
}

static int32_t max_ticks(int64_t now_ns)
{
    leave_out_time_asleep(now_ns);
    if (output_off()) {
        stalled = false;
        int32_t rest = settle_ticks; /* at once: the next command finds the coil settled, however soon it comes */
        settle_ticks = 0;
        return rest;
    }
    settle_ticks = SETTLE_TICKS;
    if (!must_wait()) {
        stalled = false;
        return BATCH;
    }
    if (!stalled)
        stalled_ns = now_ns;
    if (!stalled || (heard != commands.beat && now_ns - stalled_ns < PATIENCE_NS)) {
        stalled = true;
        heard = commands.beat;
        epoch_ns = now_ns + GRACE_NS;
        epoch_ticks = 0;
    }
    return due(now_ns);
}

static int32_t steady_ticks(int64_t now_ns)
{
    if (output_off()) {
        next_ns = now_ns;
        return max_ticks(now_ns);
    }
    if (now_ns < next_ns)
        return 0;
    int32_t n = max_ticks(now_ns);
    int64_t from_ns = now_ns - next_ns > CATCH_UP_NS ? now_ns : next_ns;
    next_ns = from_ns + n * (int64_t)NS_PER_TICK;
    return n;
}

int32_t pace_ticks(int64_t now_ns)
{
    switch (speed) {
    case PACE_REAL:
        return real_ticks(now_ns);
    case PACE_STEADY:
        return steady_ticks(now_ns);
    default:
        return max_ticks(now_ns);
    }
}

int32_t pace_wait_ms(int64_t now_ns)
{
    if (speed == PACE_REAL)
        return output_off() ? 20 : 1; /* 20 ms: half a hundred wake-ups a second cost nothing */
    if (output_off())
        return -1;
    if (speed == PACE_STEADY && !stalled)
        return 1;
    int64_t ms = (epoch_ns - now_ns) / 1000000;
    if (ms < 1)
        return 1;
    return ms < LOOK_MS ? (int32_t)ms : LOOK_MS;
}
