// Which frames to render, and which seeds to run, as a farm of machines writes it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace limber::detail {

// "1-30,47-327:2": single frames, ranges with both ends, ranges with a step; ascending, each once. "" is all
// of 0 … count−1. Frames beyond the last are left out and counted in *left_out. Throws InputError naming the
// part that is wrong, or when no frame is left.
std::vector<int> parse_frames(const std::string& text, int count, std::int64_t* left_out = nullptr);

// The same form, of the seeds of a benchmark; at most 100,000, none beyond 2³¹ − 1.
std::vector<int> parse_seeds(const std::string& text);

// The i-th of n parts, "i/n" with 1 ≤ i ≤ n, cut so that the parts differ by at most one element and together
// are all. May be empty. Throws InputError when the text is not of that form.
std::vector<int> chunk_of(const std::vector<int>& frames, const std::string& chunk);

// "1920x1080"; throws InputError when it is not of that form or a side is outside 16 … 8192.
std::pair<int, int> parse_size(const std::string& text);

}  // namespace limber::detail
