#include "can.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { FORMAT_ERROR = 1, TRANSMIT = 0x10, TRANSMIT_FD = 0x11, CONFIGURATION = 0x40 };
enum { BIT_RATE_KIND = 1, HEAD = 8 };
enum { CLOCK = -1, PLAIN = 16, XOR = 0, SUM = 1 };

typedef struct {
    int count;
    uint16_t at[64]; /* the lowest bit first: 8 * byte + n */
} Bits;

typedef struct {
    int profile, period;
    uint8_t ids[16];
    Bits counter;
    int place, kind, polynomial, start, final;
} Protection;

typedef struct {
    const char *name;
    uint32_t identifier;
    int extended, fd, length, every, first, signals;
    Protection protection;
} Frame;

typedef struct {
    const char *name;
    int reference, is_signed, real, wraps;
    Bits bits;
    double scale, offset, low, high;
    uint64_t fixed;
} Signal;

static const Frame FRAME[] = {FRAMES};
static const Signal SIGNAL[] = {SIGNALS};

static int said(Motorcycle *m, int result, const char *what, ...) {
    va_list values;
    va_start(values, what);
    vsnprintf(m->message, sizeof m->message, what, values);
    va_end(values);
    return result;
}

static uint64_t read_bits(const uint8_t *data, const Bits *b) {
    uint64_t raw = 0;
    for (int k = b->count; k-- > 0;) raw = raw << 1 | (data[b->at[k] >> 3] >> (b->at[k] & 7) & 1u);
    return raw;
}

static void write_bits(uint8_t *data, const Bits *b, uint64_t raw) {
    for (int k = 0; k < b->count; k++, raw >>= 1) {
        uint8_t one = (uint8_t)(1u << (b->at[k] & 7)), *byte = &data[b->at[k] >> 3];
        *byte = (uint8_t)(raw & 1u ? *byte | one : *byte & ~one);
    }
}

/* CRC of AUTOSAR, the highest bit first. bits: 8 or 16. */
static unsigned crc(unsigned state, unsigned polynomial, int bits, const uint8_t *data, int n) {
    unsigned top = 1u << (bits - 1), mask = (top << 1) - 1u;
    for (int k = 0; k < n; k++) {
        state ^= (unsigned)data[k] << (bits - 8);
        for (int b = 0; b < 8; b++) state = (state << 1 ^ (state & top ? polynomial : 0u)) & mask;
    }
    return state;
}

static int counter_of(const Protection *p, const uint8_t *data) {
    if (p->profile == PLAIN) return (int)read_bits(data, &p->counter);
    return p->profile == 5 ? data[2] : data[1] & 0x0F;
}

static unsigned plain_checksum(const Protection *p, const uint8_t *data, int length) {
    unsigned state = (unsigned)p->start;
    for (int k = 0; k < length; k++) {
        if (k == p->place) continue;
        if (p->kind == XOR) state ^= data[k];
        else if (p->kind == SUM) state += data[k];
        else state = crc(state, (unsigned)p->polynomial, 8, &data[k], 1);
    }
    return (state ^ (unsigned)p->final) & 0xFFu;
}

/* Checksum of the content; profiles of "SW-C End-to-End Communication Protection Library". */
static unsigned checksum(const Protection *p, const uint8_t *data, int length) {
    unsigned state;
    switch (p->profile) {
        case 1:
            state = crc(0, 0x1D, 8, p->ids, 2);
            return crc(state, 0x1D, 8, data + 1, length - 1);
        case 2:
            state = crc(0xFF, 0x2F, 8, data + 1, length - 1);
            return crc(state, 0x2F, 8, &p->ids[data[1] & 0x0F], 1) ^ 0xFF;
        case 5:
            state = crc(0xFFFF, 0x1021, 16, data + 2, length - 2);
            return crc(state, 0x1021, 16, p->ids, 2);
        default:
            return plain_checksum(p, data, length);
    }
}

static void protect(const Protection *p, uint8_t *data, int length, int counter) {
    if (p->profile == 0) return;
    if (p->profile == PLAIN) write_bits(data, &p->counter, (uint64_t)counter);
    else if (p->profile == 5) data[2] = (uint8_t)counter;
    else data[1] = (uint8_t)((data[1] & 0xF0) | counter);
    unsigned sum = checksum(p, data, length);
    if (p->profile == 5) data[1] = (uint8_t)(sum >> 8);
    if (p->profile != PLAIN) data[0] = (uint8_t)sum;
    else if (p->place >= 0) data[p->place] = (uint8_t)sum;
}

static int intact(const Protection *p, const uint8_t *data, int length) {
    if (p->profile == 0) return 1;
    if (p->period > 0 && counter_of(p, data) >= p->period) return 0;
    unsigned sum = checksum(p, data, length);
    if (p->profile == 5) return sum == (data[0] | (unsigned)data[1] << 8);
    if (p->profile != PLAIN) return sum == data[0];
    return p->place < 0 || sum == data[p->place];
}

static uint64_t raw_of(const Signal *s, double value) {
    double raw = (value - s->offset) / s->scale;
    if (!s->wraps) raw = fmin(fmax(raw, s->low), s->high);
    if (s->real && s->bits.count == 32) {
        float single = (float)raw;
        uint32_t word;
        return memcpy(&word, &single, 4), word;
    }
    if (s->real) {
        uint64_t word;
        return memcpy(&word, &raw, 8), word;
    }
    double whole = ldexp(1.0, s->bits.count);
    raw = nearbyint(raw);
    return raw < 0.0 ? (uint64_t)(int64_t)fmod(raw, whole) : (uint64_t)fmod(raw, whole);
}

static double value_of(const Signal *s, uint64_t raw) {
    double number = (double)raw;
    if (s->real && s->bits.count == 32) {
        uint32_t word = (uint32_t)raw;
        float single;
        memcpy(&single, &word, 4), number = single;
    } else if (s->real) {
        memcpy(&number, &raw, 8);
    } else if (s->is_signed && raw >> (s->bits.count - 1)) {
        number -= ldexp(1.0, s->bits.count);
    }
    return number * s->scale + s->offset;
}

static uint8_t *put(uint8_t *to, uint32_t value, int bytes) {
    for (int k = 0; k < bytes; k++) *to++ = (uint8_t)(value >> 8 * k);
    return to;
}

static uint32_t taken(const uint8_t *from, int bytes) {
    uint32_t value = 0;
    for (int k = bytes; k-- > 0;) value = value << 8 | from[k];
    return value;
}

/* Address of a new operation's arguments; NULL where the buffer is full. */
static uint8_t *operation(Motorcycle *m, uint32_t code, size_t arguments) {
    Can *can = &m->numbers.can;
    if (can->size + HEAD + arguments > BUFFER) return NULL;
    uint8_t *start = can->data + can->size;
    can->size += HEAD + arguments;
    return put(put(start, code, 4), (uint32_t)(HEAD + arguments), 4);
}

/* Returns -1 where the buffer is full. */
static int transmit(Motorcycle *m, int which) {
    const Frame *f = &FRAME[which];
    uint8_t *to = operation(m, f->fd ? TRANSMIT_FD : TRANSMIT, (f->fd ? 9u : 8u) + f->length);
    if (to == NULL) return -1;
    to = put(to, f->identifier, 4);
    to = put(to, (uint32_t)f->extended, 1);
    to = f->fd ? put(to, 0, 2) : put(to, 0, 1); /* bit rate switch, error state; or remote request */
    to = put(to, (uint32_t)f->length, 2);
    memset(to, 0, (size_t)f->length);
    for (int k = f->first; k < f->first + f->signals; k++) {
        const Signal *s = &SIGNAL[k];
        double value = m->numbers.state[0] * STEP;
        if (s->reference > 0) motorcycle_get(m, (uint32_t)s->reference, &value);
        write_bits(to, &s->bits, s->reference == 0 ? s->fixed : raw_of(s, value));
    }
    uint16_t *counter = &m->numbers.can.counters[which];
    protect(&f->protection, to, f->length, *counter);
    *counter = (uint16_t)(f->protection.period ? (*counter + 1) % f->protection.period : 0);
    return 0;
}

int can_send(Motorcycle *m) {
    int64_t steps = llround(m->numbers.state[0]), before = m->numbers.can.sent_until;
    if (steps % TICK_STEPS != 0)
        return said(m, -1, "Tx_Clock is active at %.9g s: it ticks every %.9g s", steps * STEP,
                    TICK_STEPS * STEP);
    m->numbers.can.sent_until = steps + TICK_STEPS;
    if (steps == 0 && BIT_RATE > 0) {
        uint8_t *to = operation(m, CONFIGURATION, 5);
        if (to != NULL) put(put(to, BIT_RATE_KIND, 1), BIT_RATE, 4);
    }
    for (int k = 0; k < FRAME_COUNT; k++)
        if (FRAME[k].every > 0 && steps % FRAME[k].every == 0 && transmit(m, k) != 0)
            return said(m, 1, "CAN frame %s is lost: the buffer is full", FRAME[k].name);
    if (steps <= before) return 0;
    return said(m, 1, "Tx_Clock was not active at %.9g s: frames are lost", before * STEP);
}

static int take_values(Motorcycle *m, const Frame *f, const uint8_t *data) {
    for (int k = f->first; k < f->first + f->signals; k++) {
        const Signal *s = &SIGNAL[k];
        if (s->reference <= 0) continue;
        double value = value_of(s, read_bits(data, &s->bits));
        if (motorcycle_set(m, (uint32_t)s->reference, value) != 0) {
            char why[200];
            snprintf(why, sizeof why, "%.190s", m->message);
            return said(m, -1, "CAN signal %s: %s", s->name, why);
        }
    }
    return 0;
}

static int take_frame(Motorcycle *m, const uint8_t *a, size_t size, int fd) {
    size_t head = fd ? 9 : 8;
    uint32_t identifier = taken(a, 4), length = taken(a + head - 2, 2);
    if (head + length != size) return said(m, 1, "CAN frame 0x%X: its length is wrong", identifier);
    for (int k = 0; k < FRAME_COUNT; k++) {
        const Frame *f = &FRAME[k];
        if (f->every > 0 || f->identifier != identifier || f->extended != a[4]) continue;
        if (length < (uint32_t)f->length)
            return said(m, 1, "CAN frame %s is ignored: it has %u bytes of %d", f->name, length,
                        f->length);
        if (!intact(&f->protection, a + head, f->length))
            return said(m, 1, "CAN frame %s is ignored: wrong checksum or counter", f->name);
        return take_values(m, f, a + head);
    }
    return 0;
}

/* What cannot be understood is sent back as a whole. */
static int format_error(Motorcycle *m, const uint8_t *data, size_t size) {
    size_t kept = size < 0xFFFF ? size : 0xFFFF;
    uint8_t *to = operation(m, FORMAT_ERROR, 2 + kept);
    if (to != NULL) memcpy(put(to, (uint32_t)kept, 2), data, kept);
    return said(m, 1, "operations on the bus cannot be read: %zu bytes are left", size);
}

int can_receive(Motorcycle *m, const uint8_t *data, size_t size) {
    int result = 0;
    while (size > 0) {
        uint32_t length = size < HEAD ? 0 : taken(data + 4, 4);
        if (length < HEAD || length > size) return format_error(m, data, size);
        uint32_t code = taken(data, 4);
        int fd = code == TRANSMIT_FD, now = 0;
        if (fd || code == TRANSMIT)
            now = length < HEAD + 8u + (unsigned)fd ? format_error(m, data, length)
                                                    : take_frame(m, data + HEAD, length - HEAD, fd);
        if (now < 0) return now;
        if (now > 0) result = now;
        data += length;
        size -= length;
    }
    return result;
}
