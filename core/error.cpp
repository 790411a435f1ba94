#include "core/error.h"

#include <fmt/ranges.h>

#include <csignal>

namespace limber {

Interrupted::Interrupted(int number)
    : std::runtime_error(number == SIGTERM  ? "stopped by SIGTERM"
                         : number == SIGINT ? "stopped by Ctrl-C"
                                            : "stopped, as the watcher asked"),
      signal_number(number) {}

namespace detail {

void check_failed(const char* condition, const char* file, int line, const char* value_names,
                  const std::vector<std::string>& values) {
  std::string text = fmt::format("{}:{}: {} does not hold", file, line, condition);
  if (!values.empty()) text += fmt::format("; ({}) = ({})", value_names, fmt::join(values, ", "));
  throw InternalError(text);
}

}  // namespace detail
}  // namespace limber
