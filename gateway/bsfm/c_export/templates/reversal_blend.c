static const float BLEND_SPAN_N = $span_f;

float ${p}_blend(float blend, float delta_n)
{
    if (is_finite(delta_n) && (delta_n > 0.0f || delta_n < 0.0f)) {
        if (magnitude(delta_n) >= BLEND_SPAN_N) {
            return delta_n > 0.0f ? 1.0f : -1.0f;
        }
        blend = blend + 2.0f * delta_n / BLEND_SPAN_N;
    }
    return clipped(blend, -1.0f, 1.0f);
}

float ${p}_share(const ${p}_state *state)
{
    return state->blend;
}

/* Where the calibration's branches are true: on the rising one. */
static void start(${p}_state *state)
{
    state->blend = 1.0f;
}

static void move_to(${p}_state *state, float force_n)
{
    state->blend = ${p}_blend(state->blend, force_n - state->force_n);
}

static int is_memory_damaged(const ${p}_state *state)
{
    return !is_blend(state->blend);
}
