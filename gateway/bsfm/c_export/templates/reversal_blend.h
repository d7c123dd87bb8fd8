/* The same without memory: the caller keeps the blend. ${p}_blend is the blend after the force has moved by delta_n;
 * a delta that is not finite moves nothing. ${p}_share is the blend of a state. */
${p}_status ${p}_voltage(float force_n, float blend, float *voltage_v);
${p}_status ${p}_force(float voltage_v, float blend, float *force_n);
float ${p}_blend(float blend, float delta_n);
float ${p}_share(const ${p}_state *state);
