// Trouble goes to whoever can fix it. The user: InputError (exit code 2) or DiskError (5). We: LIMBER_CHECK
// (1).
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "limber/error.h"

namespace limber {

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
