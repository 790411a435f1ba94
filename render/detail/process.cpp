#include "render/detail/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "core/process.h"

namespace limber::render::detail {

Process::Process(const std::vector<std::string>& argv) {
  const std::vector<char*> arguments = pointers_to(argv);
  // A socket, because send() can be told not to raise SIGPIPE when the other side is gone; a memory file,
  // because a pipe for the errors could fill up and block both.
  int ends[2], start[2];
  LIMBER_CHECK(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0, std::strerror(errno));
  input_ = ends[0];
  errors_ = ::memfd_create("stderr", MFD_CLOEXEC);
  LIMBER_CHECK(errors_ >= 0, std::strerror(errno));
  LIMBER_CHECK(::pipe2(start, O_CLOEXEC) == 0, std::strerror(errno));

  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) {
    // Whoever kills limber kills it too: it would write the file that the next run has cleared away.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::dup2(ends[1], 0), ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), 1), ::dup2(errors_, 2);
    ::execvp(arguments[0], arguments.data());
    const int error = errno;
    ::_exit(::write(start[1], &error, sizeof error) == sizeof error ? 127 : 126);
  }
  ::close(ends[1]), ::close(start[1]);
  int error = pid_ < 0 ? errno : 0;
  if (pid_ > 0)
    while (::read(start[0], &error, sizeof error) < 0 && errno == EINTR) {
    }
  ::close(start[0]);
  if (error == 0) return;
  if (pid_ > 0) finish();
  if (input_ >= 0) ::close(input_);
  ::close(errors_);
  throw InputError(
      fmt::format("{} cannot be started: {}; is it installed and in PATH?", argv[0], std::strerror(error)));
}

Process::~Process() {
  if (pid_ > 0) {
    ::kill(pid_, SIGTERM);
    finish();
  }
  if (input_ >= 0) ::close(input_);
  ::close(errors_);
}

bool Process::write(const void* bytes, std::size_t size) {
  for (auto* at = static_cast<const char*>(bytes); size > 0;) {
    const ssize_t sent = ::send(input_, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return false;
    at += sent, size -= std::size_t(sent);
  }
  return true;
}

int Process::finish() {
  LIMBER_CHECK(pid_ > 0, pid_);
  ::close(input_);
  input_ = -1;
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Process::said() const {
  std::string text;
  char buffer[4096];
  for (ssize_t got; (got = ::pread(errors_, buffer, sizeof buffer, off_t(text.size()))) > 0;)
    text.append(buffer, std::size_t(got));
  return text;
}

}  // namespace limber::render::detail
