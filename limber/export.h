// What of limber other programs link against.
#pragma once

#define LIMBER_API __attribute__((visibility("default")))
