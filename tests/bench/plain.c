/* A plain parser: writes the TPDOs of a candump recording as the rows of cangauge, for the four simulated DPS of
 * tests/bench/run only (INTEGER32 with three decimal digits, in psi). It checks nothing.
 *
 *     plain FILE
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int digit(char c)
{
    return c <= '9' ? c - '0' : c - 'A' + 10;
}

static char *put(char *out, unsigned long number, int width)
{
    char digits[20];
    int count = 0;
    while (number || count < width) {
        digits[count++] = '0' + number % 10;
        number /= 10;
    }
    while (count)
        *out++ = digits[--count];
    return out;
}

int main(int argc, char **argv)
{
    FILE *file = argc == 2 ? fopen(argv[1], "r") : NULL;
    static char in[1 << 16], block[1 << 16];
    char line[256], second[32] = "";
    unsigned long first = 0, known = 0;
    if (!file)
        return 2;
    setvbuf(file, in, _IOFBF, sizeof in);
    setvbuf(stdout, block, _IOFBF, sizeof block);
    fputs("time,elapsed_s,node,signal,value,unit,status,raw\n", stdout);
    while (fgets(line, sizeof line, file)) {
        char *end, *frame = strchr(line + 1, ' ');
        frame = strchr(frame + 1, ' ') + 1;
        if (frame[0] != '1' || frame[1] != '8' || frame[2] < '1' || frame[2] > '4' || frame[3] != '#')
            continue;
        unsigned long seconds = strtoul(line + 1, &end, 10);
        unsigned long micros = strtoul(end + 1, NULL, 10);
        unsigned long at = seconds * 1000000 + micros;
        if (!first)
            first = at;
        if (seconds != known) {
            time_t when = known = seconds;
            strftime(second, sizeof second, "%Y-%m-%dT%H:%M:%S.", gmtime(&when));
        }
        uint32_t number = 0;
        for (int byte = 3; byte >= 0; byte--)
            number = number << 8 | digit(frame[4 + 2 * byte]) << 4 | digit(frame[5 + 2 * byte]);
        char row[128], *out = row;
        memcpy(out, second, 20), out = put(out + 20, micros, 6);
        memcpy(out, "Z,", 2), out = put(out + 2, (at - first) / 1000000, 1), *out++ = '.';
        out = put(out, (at - first) % 1000000, 6);
        *out++ = ',', *out++ = frame[2], memcpy(out, ",pressure,", 10), out += 10;
        if ((int32_t)number < 0)
            *out++ = '-', number = -number;
        out = put(out, number / 1000, 1), *out++ = '.', out = put(out, number % 1000, 3);
        memcpy(out, ",psi,,0x", 8), memcpy(out + 8, frame + 4, 8), out[16] = '\n';
        fwrite(row, 1, out + 17 - row, stdout);
    }
    return 0;
}
