#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "core/job.h"

namespace limber::log {

void write(Level level, const std::string& line) {
  if (Job* const job = current_job()) {
    if (level == Level::warn) job->warn(line);
    return;
  }
  spdlog::log(level == Level::debug  ? spdlog::level::debug
              : level == Level::info ? spdlog::level::info
                                     : spdlog::level::warn,
              line);
}

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
