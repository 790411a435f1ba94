// Trouble goes to whoever can fix it. The user: InputError (exit code 2) or DiskError (5). We: LIMBER_CHECK
// (1).
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace limber {

// Something the user gave is wrong. The text says what, where (file, line, element), and what to try.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The disk refused: full, read-only, no permission, vanished.
struct DiskError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// SIGINT or SIGTERM arrived; what was finished is kept.
struct Interrupted : std::runtime_error {
  explicit Interrupted(int signal_number);
  int signal_number;
};

// A defect of ours.
struct InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

namespace detail {
[[noreturn]] void check_failed(const char* condition, const char* file, int line, const char* value_names,
                               const std::vector<std::string>& values);
template <class... Values>
std::vector<std::string> texts_of(const Values&... values) {
  return {fmt::format("{}", values)...};
}
}  // namespace detail

// LIMBER_CHECK(condition, values…): on in every build; a failure throws InternalError, which prints the
// values.
#define LIMBER_CHECK(condition, ...)                                                             \
  ((condition) ? void(0)                                                                         \
               : ::limber::detail::check_failed(#condition, __FILE__, __LINE__, "" #__VA_ARGS__, \
                                                ::limber::detail::texts_of(__VA_ARGS__)))

}  // namespace limber
