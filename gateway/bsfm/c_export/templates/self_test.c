/* Points of the double model: V, N rising, N falling. */
static const float POINTS[$point_count][3] = {
$points
};

/* Commands after a reset, and what the double model answers: N, V. */
static const float REVERSALS[$reversal_count][2] = {
$reversals
};

static int is_near(float value, float wanted, float tolerance)
{
    return is_finite(value) && magnitude(value - wanted) <= tolerance;
}

static int point_is_met(const branch *curve, float voltage_v, float force_n)
{
    float found_n;
    float found_v;
    return force_of(curve, voltage_v, &found_n) == ${P}_OK && is_near(found_n, force_n, $tolerance_n_f) &&
           voltage_of(curve, force_n, &found_v) != ${P}_INVALID && is_near(found_v, voltage_v, $tolerance_v_f);
}

static int points_failed(void)
{
    int i;
    for (i = 0; i < $point_count; ++i) {
        if (!point_is_met(&RISING, POINTS[i][0], POINTS[i][1]) || !point_is_met(&FALLING, POINTS[i][0], POINTS[i][2])) {
            return 100 + i;
        }
    }
    return 0;
}

static int reversals_failed(void)
{
    ${p}_state state;
    float voltage_v;
    int i;
    ${p}_reset(&state);
    for (i = 0; i < $reversal_count; ++i) {
        if (${p}_command(&state, REVERSALS[i][0], &voltage_v) == ${P}_INVALID ||
            !is_near(voltage_v, REVERSALS[i][1], $tolerance_v_f)) {
            return 200 + i;
        }
    }
    return 0;
}

static int status_is(${p}_status wanted, float force_n, float wanted_v)
{
    float voltage_v;
    ${p}_state state;
    ${p}_reset(&state);
    return ${p}_command(&state, force_n, &voltage_v) == wanted && is_near(voltage_v, wanted_v, $tolerance_v_f);
}

static float of_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int statuses_failed(void)
{
    if (!status_is(${P}_HIGH, $above_f, X1_V)) {
        return 300;
    }
    if (!status_is(${P}_LOW, $below_f, X0_V)) {
        return 301;
    }
    if (!status_is(${P}_INVALID, of_bits(0x7FC00000u), X0_V)) {
        return 302;
    }
    if (!status_is(${P}_INVALID, of_bits(0x7F800000u), X0_V)) {
        return 303;
    }
    return 0;
}

int ${p}_self_test(void)
{
    int failed = points_failed();
    if (failed == 0) {
        failed = reversals_failed();
    }
    if (failed == 0) {
        failed = statuses_failed();
    }
    return failed;
}
