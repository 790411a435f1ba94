// What one core can do at most: independent chains of multiply-adds in registers.
#pragma once

#include "fem/batch.h"

namespace limber::bench {

// Gflop/s of CPU time, a multiply-add counted as two; about 2 ms. SSE2 has no fused instruction: there a
// multiplication and an addition. The machine must have the instruction set.
double peak_gflops(fem::InstructionSet);

}  // namespace limber::bench
