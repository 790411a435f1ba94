#include "limber/detail/film/frame_list.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <set>
#include <string_view>

#include "core/error.h"

namespace limber::detail {

namespace {

std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

// The two numbers round a separator.
std::optional<std::pair<std::int64_t, std::int64_t>> pair_of(std::string_view text, char separator) {
  const auto at = text.find(separator);
  if (at == text.npos) return std::nullopt;
  const auto a = whole_number(text.substr(0, at)), b = whole_number(text.substr(at + 1));
  if (!a || !b) return std::nullopt;
  return std::pair(*a, *b);
}

struct Range {
  int first, last, step;
};

// "3,5-9:2" or "3,5-9x2": what a render farm writes. `what` is the option and `one` the thing that is
// numbered, for complaints.
std::vector<Range> ranges_of(const std::string& text, const char* what, const char* one) {
  std::vector<Range> ranges;
  std::string_view rest = text;
  while (!rest.empty()) {
    const auto comma = rest.find(',');
    const std::string_view part = rest.substr(0, comma);
    rest = comma == rest.npos ? std::string_view() : rest.substr(comma + 1);
    const auto colon = part.find_first_of(":x");
    const std::string_view range = part.substr(0, colon);
    const auto step =
        colon == part.npos ? std::optional<std::int64_t>(1) : whole_number(part.substr(colon + 1));
    const auto single = colon == part.npos ? whole_number(range) : std::nullopt;  // a step is a range's
    const auto ends = single ? std::optional(std::pair(*single, *single)) : pair_of(range, '-');
    if (!step || !ends)
      throw InputError(
          fmt::format("{} {}: \"{}\" is not {}, a range like 3-30, or a range with a step like 3-30:2", what,
                      text, part, one));
    if (*step == 0)
      throw InputError(fmt::format("{} {}: the step of \"{}\" is 0; it is 1 or more", what, text, part));
    if (ends->first > ends->second)
      throw InputError(fmt::format("{} {}: \"{}\" ends before it begins; write {}-{}", what, text, part,
                                   ends->second, ends->first));
    if (std::max(ends->second, *step) > std::numeric_limits<int>::max())
      throw InputError(fmt::format("{} {}: \"{}\" has a number above {}", what, text, part,
                                   std::numeric_limits<int>::max()));
    ranges.push_back({int(ends->first), int(ends->second), int(*step)});
  }
  return ranges;
}

}  // namespace

std::vector<int> parse_frames(const std::string& text, int count, std::int64_t* left_out) {
  std::set<int> frames;
  std::int64_t beyond = 0;
  std::vector<Range> ranges = ranges_of(text, "frames", "a frame");
  if (text.empty()) ranges.push_back({0, count - 1, 1});
  for (const Range& range : ranges)
    for (std::int64_t f = range.first; f <= range.last; f += range.step) {
      if (f >= count) {
        beyond += (range.last - f) / range.step + 1;
        break;
      }
      frames.insert(int(f));
    }
  if (frames.empty())
    throw InputError(fmt::format("frames {}: there is none of these; there are 0 … {}", text, count - 1));
  if (left_out) *left_out = beyond;
  return {frames.begin(), frames.end()};
}

std::vector<int> parse_seeds(const std::string& text) {
  constexpr std::size_t most = 100000;
  std::set<int> seeds;
  for (const Range& range : ranges_of(text, "--seeds", "a seed"))
    for (std::int64_t s = range.first; s <= range.last; s += range.step) {
      seeds.insert(int(s));
      if (seeds.size() > most)
        throw InputError(fmt::format("--seeds {}: names more than {} seeds; ask for fewer", text, most));
    }
  if (seeds.empty()) throw InputError("--seeds: names no seed; give some, like 1-30");
  return {seeds.begin(), seeds.end()};
}

std::vector<int> chunk_of(const std::vector<int>& frames, const std::string& chunk) {
  if (chunk.empty()) return frames;
  const auto parts = pair_of(chunk, '/');
  constexpr std::int64_t most = std::numeric_limits<int>::max();
  if (!parts || parts->first < 1 || parts->first > parts->second || parts->second > most)
    throw InputError(fmt::format("--chunk {}: is not i/n with 1 ≤ i ≤ n ≤ {}, like 2/8", chunk, most));
  const auto edge = [&](std::int64_t i) {
    return std::ptrdiff_t(std::int64_t(frames.size()) * i / parts->second);
  };
  return {frames.begin() + edge(parts->first - 1), frames.begin() + edge(parts->first)};
}

std::pair<int, int> parse_size(const std::string& text) {
  const auto size = pair_of(text, 'x');
  if (!size || std::min(size->first, size->second) < 16 || std::max(size->first, size->second) > 8192)
    throw InputError(
        fmt::format("size {}: is not WIDTHxHEIGHT with both in 16 … 8192, like 1920x1080", text));
  return *size;
}

}  // namespace limber::detail
