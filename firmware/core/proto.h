/* Commands in, replies out. */
#ifndef PULSETRAINER_PROTO_H
#define PULSETRAINER_PROTO_H

#include "frame.h"

/* Handles one good frame: exact length, known type, repeated sequence number; sends the reply. */
void proto_handle(const struct frame *f);

#endif
