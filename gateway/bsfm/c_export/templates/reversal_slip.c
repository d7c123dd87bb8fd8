/* Maxwell-slip stops, nearest first: each follows the voltage within its radius, their shares add up to where between the
 * branches the plant is. */
enum { STOPS = $stops };

static const float RADII_V[STOPS] = $radii;
static const float SHARES[STOPS] = $shares;
static const float STIFFNESS_PER_V = $stiffness_f; /* sum of share / radius */

float ${p}_share(const ${p}_state *state)
{
    float total = 0.0f;
    int j;
    for (j = 0; j < STOPS; ++j) {
        total = total + SHARES[j] * state->places[j];
    }
    return clipped(total, -1.0f, 1.0f);
}

/* Vented, fallen to the lowest voltage from so far above that every stop has given way. */
static void start(${p}_state *state)
{
    int j;
    for (j = 0; j < STOPS; ++j) {
        state->places[j] = -1.0f;
    }
}

static void middle_and_half(float force_n, float *middle_v, float *half_v)
{
    float rising_v;
    float falling_v;
    (void)voltage_of(&RISING, force_n, &rising_v);
    (void)voltage_of(&FALLING, force_n, &falling_v);
    *middle_v = 0.5f * (rising_v + falling_v);
    *half_v = 0.5f * (rising_v - falling_v);
}

/* The root d of d = stuck + half (share after d - share before): a broken line, solved from stop to stop as they give way. */
static float travel(const ${p}_state *state, float stuck_v, float half_v)
{
    const float way = stuck_v > 0.0f ? 1.0f : -1.0f;
    float distance_v = magnitude(stuck_v);
    float stiffness = half_v * STIFFNESS_PER_V;
    float travel_v = distance_v / (1.0f - stiffness);
    int j;
    for (j = 0; j < STOPS; ++j) {
        const float left = 1.0f - way * state->places[j];
        if (travel_v <= RADII_V[j] * left) {
            break;
        }
        distance_v = distance_v + half_v * SHARES[j] * left;
        stiffness = stiffness - half_v * SHARES[j] / RADII_V[j];
        travel_v = distance_v / (1.0f - stiffness);
    }
    return way * travel_v;
}

static void move_to(${p}_state *state, float force_n)
{
    float from_middle_v;
    float from_half_v;
    float middle_v;
    float half_v;
    float travel_v;
    int j;
    if (!(force_n < state->force_n || force_n > state->force_n)) {
        return;
    }
    middle_and_half(state->force_n, &from_middle_v, &from_half_v);
    middle_and_half(force_n, &middle_v, &half_v);
    travel_v = travel(state, middle_v - from_middle_v + ${p}_share(state) * (half_v - from_half_v), half_v);
    for (j = 0; j < STOPS; ++j) {
        state->places[j] = clipped(state->places[j] + travel_v / RADII_V[j], -1.0f, 1.0f);
    }
}

static int is_memory_damaged(const ${p}_state *state)
{
    int j;
    for (j = 0; j < STOPS; ++j) {
        if (!is_blend(state->places[j])) {
            return 1;
        }
    }
    return 0;
}
