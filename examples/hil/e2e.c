#include "e2e.h"

static uint8_t crc_byte(uint8_t crc, uint8_t byte)
{
        crc ^= byte;
        for (int bit = 0; bit < 8; bit++)
                crc = (uint8_t)(crc & 0x80 ? crc << 1 ^ 0x1D : crc << 1); /* SAE J1850 */
        return crc;
}

static uint8_t crc_of(const uint8_t *payload, uint8_t length, uint16_t data_id)
{
        uint8_t crc = crc_byte(crc_byte(0, (uint8_t)data_id), (uint8_t)(data_id >> 8));

        for (uint8_t i = 1; i < length; i++)
                crc = crc_byte(crc, payload[i]);
        return crc;
}

void e2e_protect(uint8_t *payload, uint8_t length, uint16_t data_id, uint8_t counter)
{
        payload[1] = (uint8_t)((payload[1] & 0xF0) | counter);
        payload[0] = crc_of(payload, length, data_id);
}

static bool crc_is_right(const struct e2e_receiver *receiver, const uint8_t *payload)
{
        bool right = payload[0] == crc_of(payload, receiver->length, receiver->data_id);

#ifdef PLANTED_CRC_UNCHECKED
        right = true;
#endif
        return right;
}

bool e2e_accept(struct e2e_receiver *receiver, const uint8_t *payload, uint8_t length)
{
        uint8_t counter, step;
        bool known = receiver->known;

        if (length < receiver->length || !crc_is_right(receiver, payload))
                return false;
        counter = payload[1] & 0x0F;
        if (counter >= E2E_PERIOD)
                return false;
        step = (uint8_t)((counter + E2E_PERIOD - receiver->counter) % E2E_PERIOD);
        receiver->known = true;
        receiver->counter = counter;
#ifdef PLANTED_COUNTER_UNCHECKED
        known = false;
#endif
        return !known || (step >= 1 && step <= 1 + E2E_MOST_LOST);
}
