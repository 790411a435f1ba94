#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>

namespace limber::log {

void set_up(int verbosity) {
  static const auto logger = [] {
    auto made = spdlog::stderr_color_mt("limber");
    made->set_pattern("%^%v%$");
    return made;
  }();
  logger->set_level(verbosity < 0    ? spdlog::level::warn
                    : verbosity == 0 ? spdlog::level::info
                                     : spdlog::level::debug);
  spdlog::set_default_logger(logger);
}

}  // namespace limber::log
