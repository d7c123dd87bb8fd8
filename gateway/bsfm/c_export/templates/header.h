/* ${p}.h: force <-> voltage of one calibration, in float32. Generated: do not edit, export it again.
 *
 *   calibration  $number "$title" of $date
 *   rig          $rig
 *   source       $source
 *   data         sha256 $sha256
 *   fit          order $order, residual RMS $rms N, largest $largest N
 *   range        $x0 .. $x1 V, $force_min .. $force_max N on both branches
 *   reversal     $reversal_told
$response_told *   generator    force-gateway $version
 *   accuracy     against the same model in double: force within $error_n N, voltage within $error_v V (measured)
 *
 * This is not a safety device. It computes; it does not supervise. Limits on force and voltage, a watchdog and a safe
 * state when this code stops belong to hardware or to a controller made for that.
 *
 * Use:
 *     static ${p}_state state;
 *     float voltage_v;
 *     if (${p}_self_test() != 0) { stop("compiler or flags break float32"); }
 *     ${p}_reset(&state);
 *     for (;;) {
 *         ${p}_status status = ${p}_command(&state, setpoint_n(), &voltage_v);
 *         write_dac(voltage_v);
 *         if (status == ${P}_INVALID) { alarm(); }
 *         wait_for_next_cycle();
 *     }
 *
 * Every function writes its result, whatever the status: LOW and HIGH the value at that end of the range, INVALID (an
 * input is NaN or infinite, a blend is outside -1 .. 1) the value at the lowest voltage; only ${p}_command
 * holds the last voltage instead. LOW and HIGH mean "clamped": an input equal to an end is OK.
 * Pointers must not be null. No writable statics, no heap$libm:
 * tasks may call at once, each with a state of its own.
 * Any C99 compiler and any flags that pass the self-test will do; -ffp-contract=off gives the same bits everywhere.
 */
#ifndef ${P}_H
#define ${P}_H

#ifdef __cplusplus
extern "C" {
#endif

#define ${P}_NUMBER $number
#define ${P}_ORDER $order
#define ${P}_VOLTAGE_MIN_V $x0_f
#define ${P}_VOLTAGE_MAX_V $x1_f
#define ${P}_FORCE_MIN_N $force_min_f /* both branches reach these two */
#define ${P}_FORCE_MAX_N $force_max_f

typedef enum {
    ${P}_OK = 0,
    ${P}_LOW = 1,
    ${P}_HIGH = 2,
    ${P}_INVALID = 3
} ${p}_status;

/* What is remembered between commands; owned by the caller, started by ${p}_reset. */
typedef struct {
    float force_n;   /* the last command, within what the branches reach */
$memory
    float voltage_v; /* the last answer, held while a command is invalid */
} ${p}_state;

/* State at rest: lowest voltage and force$rest. Also whenever the tool has been vented. */
void ${p}_reset(${p}_state *state);

/* Voltage for the next commanded force. Changes of command move what is remembered of reversals, so give it setpoints,
 * not measured (noisy) forces. INVALID leaves the state as it was and answers with the last voltage; if the state itself
 * is damaged (not reset, overwritten), with the lowest one. */
${p}_status ${p}_command(${p}_state *state, float force_n, float *voltage_v);

$reversal_api
/* One branch: rising while the voltage grows, falling while it shrinks. */
${p}_status ${p}_rising_force(float voltage_v, float *force_n);
${p}_status ${p}_falling_force(float voltage_v, float *force_n);
${p}_status ${p}_rising_voltage(float force_n, float *voltage_v);
${p}_status ${p}_falling_voltage(float force_n, float *voltage_v);

/* Compares this build with points of the double model, within $tolerance_n N and $tolerance_v V. 0: passed. Else what
 * failed first: 100 + i a point of the table, 200 + i a step of the reversal record, 300 + i a status. */
int ${p}_self_test(void);

#ifdef __cplusplus
}
#endif

#endif
