#include "meshing/detail/own_process.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>

#include "core/error.h"
#include "core/job.h"
#include "core/progress.h"

namespace limber::meshing::detail {

namespace {

constexpr int exit_returned = 0, exit_threw = 3, exit_no_memory = 4;

// A busy machine gives a process less than all of a core.
int clock_limit(int cpu_seconds) { return 60 + 5 * cpu_seconds; }

struct Descriptor {
  int fd;
  ~Descriptor() { close(fd); }
};

bool write_all(int fd, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += std::size_t(n);
  }
  return true;
}

std::string read_all(int fd) {
  const off_t size = lseek(fd, 0, SEEK_END);
  std::string bytes(std::size_t(std::max<off_t>(size, 0)), '\0');
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = pread(fd, bytes.data() + done, bytes.size() - done, off_t(done));
    if (n < 0 && errno == EINTR) continue;
    LIMBER_CHECK(n > 0, errno, done, bytes.size());
    done += std::size_t(n);
  }
  return bytes;
}

// Three quarters of the machine's: a memory bomb must end its own process, not another.
void limit_memory() {
#ifndef __SANITIZE_ADDRESS__  // which reserves terabytes
  const rlim_t bytes = rlim_t(sysconf(_SC_PHYS_PAGES)) / 4 * 3 * rlim_t(sysconf(_SC_PAGESIZE));
  const rlimit memory{bytes, bytes};
  setrlimit(RLIMIT_DATA, &memory);
#endif
}

[[noreturn]] void be_the_child(const std::function<std::string()>& work, int cpu_seconds, int fd) {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  prctl(PR_SET_PDEATHSIG, SIGKILL);           // or it would hold the parent's locks when that is killed
  alarm(unsigned(clock_limit(cpu_seconds)));  // it may wait for ever for a file that the model names
  if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0)
    dup2(nowhere, STDOUT_FILENO), dup2(nowhere, STDERR_FILENO);  // stdout is for data, and a crash is chatty
  limit_memory();
  const rlimit no_core{0, 0}, cpu{rlim_t(cpu_seconds), rlim_t(cpu_seconds) + 1};
  setrlimit(RLIMIT_CORE, &no_core);
  setrlimit(RLIMIT_CPU, &cpu);
  int code = exit_returned;
  std::string bytes;
  const WorkingFor nobody(nullptr);  // who watches lives in the parent, with locks that may be held there
  try {
    bytes = work();
  } catch (const std::bad_alloc&) {
    code = exit_no_memory;
  } catch (const std::exception& e) {
    code = exit_threw;
    bytes = e.what();
  }
  if (!write_all(fd, bytes)) code = exit_no_memory;
  _exit(code);  // no destructor, no exit handler: they belong to the parent
}

}  // namespace

OwnProcessResult run_in_own_process(const std::function<std::string()>& work, int cpu_seconds) {
  const Descriptor answer{memfd_create("limber", MFD_CLOEXEC)};
  LIMBER_CHECK(answer.fd >= 0, errno);
  const pid_t child = fork();
  LIMBER_CHECK(child >= 0, errno);
  if (child == 0) be_the_child(work, cpu_seconds, answer.fd);

  int status = 0;
  // Asked again and again: a signal that comes just before a wait would not end it.
  for (pid_t ended = 0; ended != child;) {
    LIMBER_CHECK(ended == 0 || errno == EINTR, errno);
    const bool stopped = stop_signal() != 0;  // asked once: who waits without end must have killed it
    if (stopped)
      kill(child, SIGKILL);
    else
      usleep(2000);
    ended = waitpid(child, &status, stopped ? 0 : WNOHANG);
  }
  throw_if_stopped();
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    if (number == SIGXCPU || number == SIGKILL)
      return {false, fmt::format("was stopped after {} s or for want of memory", cpu_seconds)};
    if (number == SIGALRM)
      return {false, fmt::format("was stopped after {} s by the clock", clock_limit(cpu_seconds))};
    return {false, fmt::format("crashed ({})", strsignal(number))};
  }
  switch (WEXITSTATUS(status)) {
    case exit_returned:
      return {true, read_all(answer.fd)};
    case exit_threw:
      return {false, read_all(answer.fd)};
    case exit_no_memory:
      return {false, "ran out of memory"};
    default:
      return {false, fmt::format("crashed (exit {})", WEXITSTATUS(status))};
  }
}

}  // namespace limber::meshing::detail
