/* Sends TPDOs of node 1 to 4 (181h to 184h, a 32-bit sequence number from 2^24 on) for some seconds, as fast as the
 * interface accepts them.
 *
 *     blast IFACE SECONDS
 *
 * Prints the number of frames. Build: cc -O2 -o blast blast.c
 */
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec + time.tv_nsec / 1e9;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "blast IFACE SECONDS\n");
        return 2;
    }
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = if_nametoindex(argv[1])};
    int bus = socket(AF_CAN, SOCK_RAW, CAN_RAW);
    /* Without a filter, this socket receives nothing. */
    if (bus < 0 || setsockopt(bus, SOL_CAN_RAW, CAN_RAW_FILTER, NULL, 0) ||
        bind(bus, (struct sockaddr *)&address, sizeof address)) {
        perror(argv[1]);
        return 1;
    }
    const uint32_t first = 1 << 24;
    uint32_t count = first;
    for (double end = now() + atof(argv[2]); count % 64 || now() < end; count++) {
        struct can_frame frame = {.can_id = 0x181 + count % 4, .can_dlc = 4};
        memcpy(frame.data, &count, sizeof count);
        while (write(bus, &frame, sizeof frame) != sizeof frame) {
            if (errno != ENOBUFS) {
                perror("write");
                return 1;
            }
            usleep(100);
        }
    }
    printf("%u\n", count - first);
    return 0;
}
