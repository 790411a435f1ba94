#include "limber/detail/batch/limited_process.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "core/error.h"
#include "core/process.h"

namespace limber::detail {

namespace {

constexpr double between_questions_s = 0.05;  // for its memory
constexpr double mib = 1 << 20;

void limit(const ProcessLimits& limits) {
  const auto cpu = rlim_t(std::ceil(limits.cpu_s));
  const rlimit no_core{0, 0}, time{cpu, cpu + 2};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::setrlimit(RLIMIT_CPU, &time);
#ifndef __SANITIZE_ADDRESS__  // which reserves terabytes
  // For what grows so fast that nobody sees it in time, and for processes of its own.
  const auto bytes = rlim_t(limits.memory_mb * mib);
  const rlimit memory{bytes, bytes};
  ::setrlimit(RLIMIT_DATA, &memory);
#endif
}

// What it holds now; 0 when it has just ended.
double resident_mb(int pid) {
  std::FILE* file = std::fopen(fmt::format("/proc/{}/statm", pid).c_str(), "re");
  if (!file) return 0;
  long all = 0, resident = 0;
  const bool read = std::fscanf(file, "%ld %ld", &all, &resident) == 2;
  std::fclose(file);
  return read ? double(resident) * double(::sysconf(_SC_PAGESIZE)) / mib : 0;
}

std::string content_of(int fd, std::size_t most) {
  const off_t size = std::max<off_t>(::lseek(fd, 0, SEEK_END), 0);
  const off_t first = std::max<off_t>(size - off_t(most), 0);
  std::string text(std::size_t(size - first), '\0');
  const ssize_t got = ::pread(fd, text.data(), text.size(), first);
  text.resize(std::size_t(std::max<ssize_t>(got, 0)));
  return text;
}

}  // namespace

LimitedProcess::LimitedProcess(const std::vector<std::string>& words, const ProcessLimits& limits)
    : limits_(limits) {
  out_ = ::memfd_create("stdout", MFD_CLOEXEC), err_ = ::memfd_create("stderr", MFD_CLOEXEC);
  LIMBER_CHECK(out_ >= 0 && err_ >= 0, std::strerror(errno));
  // What it starts is of its group, and ends with it.
  pid_ = start_this_program(words, out_, err_, [&] { limit(limits); });
}

LimitedProcess::~LimitedProcess() {
  if (pid_ > 0) {
    ::kill(-pid_, SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  ::close(out_), ::close(err_);
}

double LimitedProcess::clock_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

std::optional<EndedProcess> LimitedProcess::ended() {
  LIMBER_CHECK(pid_ > 0, pid_);
  int status = 0;
  rusage usage{};
  const pid_t which = ::wait4(pid_, &status, WNOHANG, &usage);
  LIMBER_CHECK(which == 0 || which == pid_ || errno == EINTR, std::strerror(errno));
  if (which != pid_) {
    const double now = clock_s();
    if (now > limits_.clock_s) over_ = EndedProcess::out_of_time;
    if (now > memory_asked_s_ + between_questions_s) {
      memory_asked_s_ = now;
      if (resident_mb(pid_) > limits_.memory_mb) over_ = EndedProcess::out_of_memory;
    }
    if (over_ != EndedProcess::exited) ::kill(-pid_, SIGKILL);
    return std::nullopt;
  }
  ::kill(-pid_, SIGKILL);  // what it has left
  pid_ = -1;
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  EndedProcess end;
  end.clock_s = clock_s();
  end.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  end.peak_mb = double(usage.ru_maxrss) / 1024;
  end.out = content_of(out_, std::size_t(64) << 20), end.err = content_of(err_, 4096);
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
  if (over_ != EndedProcess::exited)
    end.reason = over_;
  else if (WIFSIGNALED(status))
    end.reason = end.code == SIGXCPU || (end.code == SIGKILL && end.cpu_s >= limits_.cpu_s)
                     ? EndedProcess::out_of_time
                     : EndedProcess::crashed;
  return end;
}

void LimitedProcess::stop() {
  if (pid_ > 0) ::kill(-pid_, SIGTERM);
}

}  // namespace limber::detail
