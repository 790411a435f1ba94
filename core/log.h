// Lines for the person at the terminal: always stderr, so that stdout stays data. log::info("{} tets", n). In
// a call of the library its Watcher gets the warnings, and there is nobody for the rest.
#pragma once

#include <fmt/format.h>

#include <string>

namespace limber::log {

enum class Level { debug, info, warn };
void write(Level, const std::string& line);

template <class... Args>
void debug(fmt::format_string<Args...> text, Args&&... args) {
  write(Level::debug, fmt::format(text, std::forward<Args>(args)...));
}
template <class... Args>
void info(fmt::format_string<Args...> text, Args&&... args) {
  write(Level::info, fmt::format(text, std::forward<Args>(args)...));
}
template <class... Args>
void warn(fmt::format_string<Args...> text, Args&&... args) {
  write(Level::warn, fmt::format(text, std::forward<Args>(args)...));
}

void set_up(int verbosity);  // −1 warnings only, 0 info, 1 debug

}  // namespace limber::log
