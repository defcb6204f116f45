/* AUTOSAR E2E profile 1: CRC-8 in byte 0 over data id, counter and payload; counter 0 to 14. */
#ifndef E2E_H
#define E2E_H

#include <stdbool.h>
#include <stdint.h>

#define E2E_PERIOD 15
#define E2E_MOST_LOST 4 /* frames lost in a row after which the next frame is not accepted */

/* Receiver of one message. */
struct e2e_receiver {
        uint16_t data_id;
        uint8_t length;  /* bytes, of the whole payload */
        bool known;      /* a frame with a right CRC has been received */
        uint8_t counter; /* of that frame */
};

/* Write counter and CRC into a payload. */
void e2e_protect(uint8_t *payload, uint8_t length, uint16_t data_id, uint8_t counter);

/* Whether a frame may be used: long enough, CRC right, counter advanced by 1 to 1 + E2E_MOST_LOST. */
bool e2e_accept(struct e2e_receiver *receiver, const uint8_t *payload, uint8_t length);

#endif
