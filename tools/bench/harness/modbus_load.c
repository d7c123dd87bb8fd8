/* Load for a Modbus TCP server: N connections, one outstanding request on each, for a fixed time, over one epoll.
 *
 *   modbus_load PORT SECONDS CONNECTIONS read|write|setpoints
 *
 * read: FC03, 32 registers from address 100. write: FC16, 13 registers from address 0, the heartbeat another one in each, as
 * of a PLC that holds a force. setpoints: the force as well, as of a robot on its way.
 * Prints: answered requests, elapsed seconds, faulty answers (wrong transaction id, length or function).
 */
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { MOST = 256, READ_COUNT = 32, WRITE_COUNT = 13, FORCE_AT = 13 + 2 * 1, HEARTBEAT_AT = 13 + 2 * 4 };

struct connection {
    int fd;
    uint16_t transaction;
    int filled;
    uint8_t answer[300];
};

static uint8_t request[300];
static int request_size, answer_size, function, is_of_setpoints;
static long answered, faulty;

static double now_s(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

static void die(const char *what) {
    perror(what);
    exit(1);
}

static void make_request(int write_run) {
    int data = write_run ? 2 * WRITE_COUNT : 0;
    int count = write_run ? WRITE_COUNT : READ_COUNT;
    function = write_run ? 16 : 3;
    request_size = write_run ? 13 + data : 12;
    answer_size = write_run ? 12 : 9 + 2 * READ_COUNT;
    request[5] = request_size - 6;
    request[6] = 1;
    request[7] = function;
    request[9] = write_run ? 0 : 100;
    request[11] = count;
    if (write_run)
        request[12] = data; /* the other words stay 0: "output disabled" is accepted by every bank */
}

static void send_request(struct connection *c) {
    c->transaction++;
    request[0] = c->transaction >> 8;
    request[1] = c->transaction & 0xFF;
    if (function == 16)
        memcpy(request + HEARTBEAT_AT, request, 2);
    if (is_of_setpoints) { /* 7.68 N to 10.23 N, which every bank accepts */
        request[FORCE_AT] = 3;
        request[FORCE_AT + 1] = request[1];
    }
    c->filled = 0;
    if (send(c->fd, request, request_size, MSG_NOSIGNAL) != request_size)
        die("send");
}

static void receive(struct connection *c) {
    ssize_t n = recv(c->fd, c->answer + c->filled, sizeof c->answer - c->filled, 0);
    if (n <= 0)
        die(n ? "recv" : "the server closed the connection");
    c->filled += n;
    if (c->filled < 6 || c->filled < 6 + c->answer[5])
        return;
    if ((c->answer[0] << 8 | c->answer[1]) != c->transaction || c->filled != answer_size || c->answer[7] != function)
        faulty++;
    answered++;
    send_request(c);
}

static void open_connection(struct connection *c, int port) {
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(port)};
    int one = 1;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    c->fd = socket(AF_INET, SOCK_STREAM, 0);
    if (connect(c->fd, (struct sockaddr *)&to, sizeof to))
        die("connect");
    setsockopt(c->fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
}

int main(int argc, char **argv) {
    static struct connection connections[MOST];
    struct epoll_event events[MOST];
    if (argc != 5 || atoi(argv[3]) < 1 || atoi(argv[3]) > MOST)
        return fprintf(stderr, "usage: modbus_load PORT SECONDS CONNECTIONS read|write|setpoints\n"), 2;
    int count = atoi(argv[3]), poll_fd = epoll_create1(0);
    is_of_setpoints = strcmp(argv[4], "setpoints") == 0;
    make_request(is_of_setpoints || strcmp(argv[4], "write") == 0);
    for (int i = 0; i < count; i++) {
        struct epoll_event event = {.events = EPOLLIN, .data.ptr = &connections[i]};
        open_connection(&connections[i], atoi(argv[1]));
        epoll_ctl(poll_fd, EPOLL_CTL_ADD, connections[i].fd, &event);
    }
    double start = now_s(), end = start + atof(argv[2]);
    for (int i = 0; i < count; i++)
        send_request(&connections[i]);
    while (now_s() < end) {
        int ready = epoll_wait(poll_fd, events, MOST, 100);
        if (ready < 0 && errno != EINTR)
            die("epoll_wait");
        for (int i = 0; i < ready; i++)
            receive(events[i].data.ptr);
    }
    printf("%ld %.6f %ld\n", answered, now_s() - start, faulty);
    return 0;
}
