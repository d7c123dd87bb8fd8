/* The generated client of C on a system of the test: see c_program.py. */
#define socket at_hand_socket
#define connect at_hand_connect
#define close at_hand_close
#define fcntl at_hand_fcntl
#define setsockopt at_hand_setsockopt
#define getsockopt at_hand_getsockopt
#define poll at_hand_poll
#define send at_hand_send
#define recv at_hand_recv
#define clock_gettime at_hand_clock
#define FORCE_GATEWAY_IMPLEMENTATION
#include "force_gateway.h"
#include <stdarg.h>
#include <stdlib.h>

typedef int (*answer_function)(const uint8_t *frame, int count, uint8_t *answer);
typedef int (*accept_function)(void);
static answer_function answer_of;
static accept_function accepts;
static long long clock_ms;
static uint8_t waiting[600];
static int first, end;
static int blocks, connects; /* the socket waits; its connection is still to come */
static int signals; /* that come while the program waits */

int at_hand_socket(int family, int type, int protocol) { (void)family; (void)type; (void)protocol; first = end = connects = 0; blocks = 1; return 1000; }
int at_hand_connect(int s, const struct sockaddr *to, socklen_t n) {
    const int answer = accepts(); /* 0 refuses, 1 accepts, 2 is silent */
    (void)s; (void)to; (void)n;
    if (answer == 1) return 0;
    connects = answer == 2 && !blocks;
    if (answer == 2 && blocks) clock_ms += 130000; /* as long as TCP tries */
    errno = connects ? EINPROGRESS : answer ? ETIMEDOUT : ECONNREFUSED;
    return -1;
}
int at_hand_close(int s) { (void)s; return 0; }
int at_hand_fcntl(int s, int what, ...) {
    va_list given;
    (void)s;
    va_start(given, what);
    if (what == F_SETFL && va_arg(given, int) & O_NONBLOCK) blocks = 0;
    va_end(given);
    return 0;
}
int at_hand_setsockopt(int s, int l, int o, const void *v, socklen_t n) { (void)s; (void)l; (void)o; (void)v; (void)n; return 0; }
int at_hand_getsockopt(int s, int l, int o, void *v, socklen_t *n) { (void)s; (void)l; (void)o; (void)v; (void)n; return 0; }
int at_hand_poll(struct pollfd *waited, nfds_t count, int ms) {
    (void)count;
    if (signals > 0) {
        signals--;
        errno = EINTR;
        return -1;
    }
    if ((waited->events & POLLOUT && !connects) || first < end || end < 0) return 1;
    clock_ms += ms;
    return 0;
}
ssize_t at_hand_send(int s, const void *data, size_t count, int flags) {
    (void)s; (void)flags;
    first = 0;
    end = answer_of(data, (int)count, waiting);
    return (ssize_t)count;
}
ssize_t at_hand_recv(int s, void *data, size_t count, int flags) {
    size_t given = count < (size_t)(end - first) ? count : (size_t)(end - first);
    (void)s; (void)flags;
    if (end < 0) return 0; /* the far end has closed */
    memcpy(data, waiting + first, given);
    first += (int)given;
    return (ssize_t)given;
}
int at_hand_clock(clockid_t which, struct timespec *now) {
    (void)which;
    now->tv_sec = clock_ms / 1000;
    now->tv_nsec = clock_ms % 1000 * 1000000;
    return 0;
}
void use(answer_function answer, accept_function accept, long long now_ms) { answer_of = answer; accepts = accept; clock_ms = now_ms; }
long long time_ms(void) { return clock_ms; }
void send_signals(int count) { signals = count; }
fg_client *make(int unit) {
    fg_client *client = malloc(sizeof *client);
    fg_init(client, "127.0.0.1", 502, (uint8_t)unit);
    return client;
}
int is_enabled(const fg_client *client) { return client->status.enabled; }
int is_in_band(const fg_client *client) { return client->status.in_band; }
float force_measured(const fg_client *client) { return client->status.force_measured; }
int has_ended(const fg_client *client) { return client->ended; }
const char *message(const fg_client *client) { return client->message; }
const char *fault(const fg_client *client) { return client->status.fault ? fg_fault_text(client->status.fault_code) : ""; }
fg_model *make_model(void) { return calloc(1, sizeof(fg_model)); }
void set_model(fg_model *m, int order, const float *lists, const float *ranges) {
    m->order = (uint16_t)order;
    for (int k = 0; k <= order; k++) {
        m->rising_b[k] = lists[k];
        m->rising_w[k] = lists[16 + k];
        m->falling_b[k] = lists[32 + k];
        m->falling_w[k] = lists[48 + k];
    }
    m->range_low = ranges[0]; m->range_high = ranges[1];
    m->force_low = ranges[2]; m->force_high = ranges[3]; m->blend_span = ranges[4];
}
