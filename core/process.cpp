#include "core/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "core/error.h"

namespace limber {

bool is_in_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/bin:/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (::access(((folder.empty() ? "." : folder) + "/" + program).c_str(), X_OK) == 0) return true;
  return false;
}

fs::path program_file() {
  std::error_code none;
  return fs::read_symlink("/proc/self/exe", none);
}

long long start_of_process(long long pid) {
  try {
    const std::string stat = read_file(fmt::format("/proc/{}/stat", pid));
    std::size_t at = stat.rfind(')');  // the name may hold anything
    if (at != stat.npos && stat.compare(at, 3, ") Z") == 0) return 0;
    for (int field = 2; field < 22 && at != stat.npos; ++field) at = stat.find(' ', at + 1);
    return at == stat.npos ? 0 : std::atoll(stat.c_str() + at);
  } catch (const InputError&) {
    return 0;
  }
}

bool has_ended(long long pid) {
  static const bool told = start_of_process(::getpid()) != 0;
  if (::kill(pid_t(pid), 0) != 0) return errno == ESRCH;  // of another user /proc may not tell
  return told && start_of_process(pid) == 0;
}

std::vector<char*> pointers_to(const std::vector<std::string>& words) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  return argv;
}

int start_this_program(const std::vector<std::string>& words, int out, int err,
                       const std::function<void()>& in_child) {
  std::vector<std::string> all{"limber"};
  all.insert(all.end(), words.begin(), words.end());
  const std::vector<char*> argv = pointers_to(all);
  const pid_t parent = ::getpid(), child = ::fork();
  LIMBER_CHECK(child >= 0, std::strerror(errno));
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::setpgid(0, 0);
    if (in_child) in_child();
    ::dup2(::open("/dev/null", O_RDONLY | O_CLOEXEC), 0), ::dup2(out, 1), ::dup2(err, 2);
    ::execv("/proc/self/exe", argv.data());
    ::_exit(127);
  }
  ::setpgid(child, child);
  return child;
}

}  // namespace limber
