#include "limber/detail/farm/run_program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "core/error.h"
#include "core/process.h"

namespace limber::detail {

namespace {

int code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

std::string text_in(int fd) {
  std::string text(std::size_t(std::max<off_t>(0, ::lseek(fd, 0, SEEK_END))), '\0');
  const ssize_t got = ::pread(fd, text.data(), text.size(), 0);
  text.resize(std::size_t(std::max<ssize_t>(0, got)));
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

}  // namespace

RanProgram run_program(const std::vector<std::string>& words, double patience_s) {
  if (!is_in_path(words[0]))
    throw InputError(fmt::format("{} is not in PATH; is it installed here?", words[0]));
  RanProgram ran;
  const int out = ::memfd_create("stdout", MFD_CLOEXEC), err = ::memfd_create("stderr", MFD_CLOEXEC);
  LIMBER_CHECK(out >= 0 && err >= 0, std::strerror(errno));
  std::vector<char*> argv = pointers_to(words);
  const pid_t pid = ::fork();
  LIMBER_CHECK(pid >= 0, std::strerror(errno));
  if (pid == 0) {
    ::setpgid(0, 0);  // Ctrl-C is for limber: a job that is half sent would be lost
    ::dup2(::open("/dev/null", O_RDONLY | O_CLOEXEC), 0), ::dup2(out, 1), ::dup2(err, 2);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  const auto began = std::chrono::steady_clock::now();
  int status = 0;
  bool late = false;
  for (pid_t which = 0; which != pid; which = ::waitpid(pid, &status, late ? 0 : WNOHANG)) {
    if (!late && std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() > patience_s)
      ::kill(pid, SIGKILL), late = true;
    ::usleep(2000);
  }
  ran = {code_of(status), text_in(out), text_in(err)};
  ::close(out), ::close(err);
  if (late) throw InputError(fmt::format("{} did not answer within {:g} s", words[0], patience_s));
  return ran;
}

ChildWorker::ChildWorker(const std::vector<std::string>& words, const fs::path& log) {
  const int said = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (said < 0) throw DiskError(fmt::format("{}: cannot be made: {}", log.string(), std::strerror(errno)));
  pid_ = start_this_program(words, said, said);
  ::close(said);
}

ChildWorker::~ChildWorker() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

bool ChildWorker::ended() {
  if (pid_ <= 0) return true;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return false;
  pid_ = -1, code_ = code_of(status);
  return true;
}

void ChildWorker::stop() {
  if (pid_ > 0) ::kill(pid_, SIGTERM);
}

}  // namespace limber::detail
