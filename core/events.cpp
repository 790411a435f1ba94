#include "core/events.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>

#include "core/error.h"
#include "core/job.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/progress.h"

namespace limber::events {

namespace {

std::mutex mutex;
std::FILE* file = nullptr;  // null: nobody watches

// Where stderr is for events, warnings are events.
class Sink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    tell({{"event", "warning"}, {"text", std::string(message.payload.data(), message.payload.size())}});
  }
  void flush_() override {}
};

}  // namespace

void set_up(const std::string& where) {
  if (file && file != stderr) std::fclose(file);
  file = where.empty() ? nullptr : where == "json" ? stderr : std::fopen(where.c_str(), "we");
  if (!where.empty() && !file)
    throw DiskError(fmt::format("{}: creating it failed: {}", where, std::strerror(errno)));
  if (file != stderr) return;
  set_progress_enabled(false);
  const auto logger = std::make_shared<spdlog::logger>("limber-events", std::make_shared<Sink>());
  logger->set_level(spdlog::level::warn);
  spdlog::set_default_logger(logger);
}

bool wanted() { return file != nullptr; }

void tell(const Json& event) {
  if (current_job()) return;  // whose watcher is told otherwise
  const std::lock_guard lock(mutex);
  if (!file) return;
  const std::string line = text_of(event) + "\n";
  if (std::fwrite(line.data(), 1, line.size(), file) == line.size() && std::fflush(file) == 0) return;
  if (file != stderr) log::warn("--progress: writing failed: {}", std::strerror(errno));
  file = nullptr;
}

}  // namespace limber::events
