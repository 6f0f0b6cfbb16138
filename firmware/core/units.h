/* Conversions between ADC counts, wire units and bytes. */
#ifndef PULSETRAINER_UNITS_H
#define PULSETRAINER_UNITS_H

#include <stdint.h>

/* The PID relies on >> of a negative number keeping its sign, as every compiler in question does. */
typedef char units_arithmetic_shift[((-1) >> 1) == -1 ? 1 : -1];

/* 12-bit counts over 0..2 A to 100 uA: 20000 / 4095 in 14 fractional bits. */
static inline int16_t units_current(uint16_t counts)
{
    return (int16_t)(((uint32_t)counts * 80020u + 8192u) >> 14);
}

/* 12-bit counts over -1..17 N to mN: 18000 / 4095 in 14 fractional bits. */
static inline int16_t units_force(uint16_t counts)
{
    return (int16_t)((int16_t)(((uint32_t)counts * 72018u + 8192u) >> 14) - 1000);
}

static inline uint16_t get_u16(const uint8_t *p)
{
    return (uint16_t)(p[0] | ((uint16_t)p[1] << 8));
}

static inline int16_t get_i16(const uint8_t *p)
{
    return (int16_t)get_u16(p);
}

static inline uint32_t get_u32(const uint8_t *p)
{
    return (uint32_t)get_u16(p) | ((uint32_t)get_u16(p + 2) << 16);
}

static inline int32_t get_i32(const uint8_t *p)
{
    return (int32_t)get_u32(p);
}

static inline void put_u16(uint8_t *p, uint16_t v)
{
    p[0] = (uint8_t)(v & 0xFFu);
    p[1] = (uint8_t)(v >> 8);
}

static inline void put_i16(uint8_t *p, int16_t v)
{
    put_u16(p, (uint16_t)v);
}

static inline void put_u32(uint8_t *p, uint32_t v)
{
    put_u16(p, (uint16_t)(v & 0xFFFFu));
    put_u16(p + 2, (uint16_t)(v >> 16));
}

static inline void put_i32(uint8_t *p, int32_t v)
{
    put_u32(p, (uint32_t)v);
}

#endif
