/* The yardstick: a Modbus TCP server on libmodbus, several connections in one poll() loop, as its own examples do it.
 *
 *   libmodbus_server            prints the port that it listens on (127.0.0.1), serves until it is killed
 */
#include <arpa/inet.h>
#include <errno.h>
#include <modbus/modbus.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <sys/socket.h>
#include <unistd.h>

enum { MOST = 256 };

static int listen_anywhere(void) {
    struct sockaddr_in at = {.sin_family = AF_INET};
    socklen_t size = sizeof at;
    int fd = socket(AF_INET, SOCK_STREAM, 0);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(fd, (struct sockaddr *)&at, size) || listen(fd, 64) || getsockname(fd, (struct sockaddr *)&at, &size))
        return -1;
    printf("%d\n", ntohs(at.sin_port));
    fflush(stdout);
    return fd;
}

static int accept_one(int listener) {
    int one = 1, fd = accept(listener, NULL, NULL);
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    return fd;
}

static int serve(modbus_t *server, modbus_mapping_t *registers, int fd) {
    uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    modbus_set_socket(server, fd);
    int size = modbus_receive(server, request);
    if (size < 0)
        return -1;
    return size == 0 ? 0 : modbus_reply(server, request, size, registers);
}

int main(void) {
    struct pollfd watched[MOST];
    int count = 1;
    modbus_t *server = modbus_new_tcp("127.0.0.1", 0);
    modbus_mapping_t *registers = modbus_mapping_new(0, 0, 2000, 0);
    watched[0] = (struct pollfd){.fd = listen_anywhere(), .events = POLLIN};
    if (!server || !registers || watched[0].fd < 0)
        return perror("libmodbus_server"), 1;
    while (poll(watched, count, -1) >= 0 || errno == EINTR) {
        for (int i = count - 1; i > 0; i--)
            if (watched[i].revents && serve(server, registers, watched[i].fd) < 0) {
                close(watched[i].fd);
                watched[i] = watched[--count];
            }
        if (watched[0].revents && count < MOST)
            watched[count++] = (struct pollfd){.fd = accept_one(watched[0].fd), .events = POLLIN};
    }
    return 0;
}
