// ChildProcess: a program of ours as a person starts it, with its output in files. Killed when it goes out of
// scope.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/eventually.h"

namespace strandcast::test {

class ChildProcess {
 public:
  /// Both outputs go to the file `output`.
  ChildProcess(const std::string& program, std::vector<std::string> arguments,
               const std::filesystem::path& output) {
    arguments.insert(arguments.begin(), program);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    if (posix_spawn(&process_, program.c_str(), &actions, nullptr, pointers.data(), environ) != 0)
      process_ = -1;
    posix_spawn_file_actions_destroy(&actions);
  }
  ~ChildProcess() {
    if (process_ <= 0 || has_ended()) return;
    send_signal(SIGKILL);
    waitpid(process_, &status_, 0);
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void send_signal(int number) const { kill(process_, number); }
  /// From now on it can open no more than so many files, sockets included.
  void limit_descriptors(rlim_t count) const {
    const rlimit limit{count, count};
    prlimit(process_, RLIMIT_NOFILE, &limit, nullptr);
  }
  pid_t id() const { return process_; }
  bool has_ended() {
    if (!has_ended_ && waitpid(process_, &status_, WNOHANG) == process_) has_ended_ = true;
    return has_ended_;
  }
  /// Waits for its end: the exit code, -1 for a signal or when it does not end.
  int wait() {
    if (!eventually([this] { return has_ended(); })) return -1;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
  }

 private:
  pid_t process_ = -1;
  int status_ = 0;
  bool has_ended_ = false;
};

}  // namespace strandcast::test
