/* A minimal SDO client: one send and one receive for each exchange. It checks only aborts. A faster client
 * saves system calls; a slower one does additional work.
 *
 *     bare IFACE NODE reads COUNT      expedited uploads of 2002h
 *     bare IFACE NODE read|write|block-read|block-write BYTES      2000h; write sends zeros
 *
 * Prints the seconds used. Build: cc -O2 -o bare bare.c
 */
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static int bus, node;
static struct can_frame in;

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

static void put(const unsigned char *data)
{
    struct can_frame out = {.can_id = 0x600 + node, .can_dlc = 8};
    memcpy(out.data, data, 8);
    if (write(bus, &out, sizeof out) != sizeof out)
        fail("write");
}

static unsigned char *get(void)
{
    if (read(bus, &in, sizeof in) != sizeof in)
        fail("read");
    if (in.data[0] == 0x80) {
        fprintf(stderr, "bare: aborted\n");
        exit(1);
    }
    return in.data;
}

static unsigned char *ask(const unsigned char *data)
{
    put(data);
    return get();
}

static void reads(long count)
{
    while (count--)
        ask((unsigned char[8]){0x40, 0x02, 0x20, 0});
}

static void read_segments(void)
{
    unsigned char segment[8] = {0x60};
    ask((unsigned char[8]){0x40, 0x00, 0x20, 0});
    while (!(ask(segment)[0] & 1))
        segment[0] ^= 0x10;
}

static void write_segments(long size)
{
    unsigned char first[8] = {0x21, 0x00, 0x20, 0, size, size >> 8, size >> 16}, segment[8] = {0};
    ask(first);
    for (; size > 7; size -= 7) {
        ask(segment);
        segment[0] ^= 0x10;
    }
    segment[0] |= (7 - size) << 1 | 1;
    ask(segment);
}

static void read_blocks(void)
{
    ask((unsigned char[8]){0xa0, 0x00, 0x20, 0, 127});
    put((unsigned char[8]){0xa3});
    for (;;) {
        unsigned char head = get()[0];
        if (head == 127 || head & 0x80)
            put((unsigned char[8]){0xa2, head & 0x7f, 127});
        if (head & 0x80)
            break;
    }
    get();
    put((unsigned char[8]){0xa1});
}

static void write_blocks(long size)
{
    unsigned char first[8] = {0xc2, 0x00, 0x20, 0, size, size >> 8, size >> 16};
    unsigned char block_size = ask(first)[4], segment[8] = {0};
    for (; size > 0; size -= 7) {
        segment[0]++;
        if (size <= 7)
            segment[0] |= 0x80;
        put(segment);
        if (size <= 7 || segment[0] == block_size) {
            get();
            segment[0] = 0;
        }
    }
    ask((unsigned char[8]){0xc1 | -size << 2});
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        fprintf(stderr, "bare IFACE NODE reads|read|write|block-read|block-write NUMBER\n");
        return 2;
    }
    node = atoi(argv[2]);
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = if_nametoindex(argv[1])};
    struct can_filter filter = {.can_id = 0x580 + node, .can_mask = CAN_SFF_MASK};
    bus = socket(AF_CAN, SOCK_RAW, CAN_RAW);
    if (bus < 0 || setsockopt(bus, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter) ||
        bind(bus, (struct sockaddr *)&address, sizeof address))
        fail(argv[1]);
    long number = atol(argv[4]);
    struct timespec start, end;
    clock_gettime(CLOCK_MONOTONIC, &start);
    if (!strcmp(argv[3], "reads"))
        reads(number);
    else if (!strcmp(argv[3], "read"))
        read_segments();
    else if (!strcmp(argv[3], "write"))
        write_segments(number);
    else if (!strcmp(argv[3], "block-read"))
        read_blocks();
    else
        write_blocks(number);
    clock_gettime(CLOCK_MONOTONIC, &end);
    printf("%.6f\n", end.tv_sec - start.tv_sec + (end.tv_nsec - start.tv_nsec) / 1e9);
    return 0;
}
