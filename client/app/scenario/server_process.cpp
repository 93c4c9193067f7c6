#include "client/app/scenario/server_process.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fstream>
#include <thread>
#include <utility>

#include "client/app/ctl_commands.h"
#include "common/base/file.h"
#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/log/log.h"

extern char** environ;

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kProcessPoll{10};
constexpr milliseconds kEndTimeout{8'000};  // from the wish to the kill
constexpr int kRestarts = 20;               // the port may be taken for a moment
constexpr milliseconds kRestartPause{100};
constexpr uint64_t kMaxPortFileBytes = 64;
constexpr size_t kMaxShownChars = 300;
constexpr mode_t kOwnerOnly = 0600;

struct ChildFiles {
  int null = -1, output = -1;
  int failed = -1;  // gets errno where the program does not start
};

/// In the child, where only async-signal-safe calls are allowed: becomes the program that `words` begin with.
/// It is told to end when the thread that made it does, whatever ends that.
[[noreturn]] void become(const std::vector<char*>& words, const ChildFiles& files) {
  // A group of its own: Ctrl-C is for us, and we end it.
  // A file that may not grow is an error of writing, and no end of the program.
  signal(SIGXFSZ, SIG_IGN);
  const bool is_ready = prctl(PR_SET_PDEATHSIG, SIGTERM) == 0 && setpgid(0, 0) == 0 &&
                        dup2(files.null, STDIN_FILENO) >= 0 && dup2(files.null, STDOUT_FILENO) >= 0 &&
                        dup2(files.output, STDERR_FILENO) >= 0;
  if (is_ready) execve(words.front(), words.data(), environ);
  const int failure = errno;
  [[maybe_unused]] const ssize_t written = write(files.failed, &failure, sizeof failure);
  _exit(EXIT_FAILURE);
}

}  // namespace

Result<std::filesystem::path> make_temporary_folder() {
  std::error_code failure;
  std::string path = (std::filesystem::temp_directory_path(failure) / "strandcast-XXXXXX").string();
  if (failure || mkdtemp(path.data()) == nullptr)
    return make_error(ErrorCode::Unavailable, "cannot make a folder for temporary files in {}", path);
  return std::filesystem::path(path);
}

Result<std::filesystem::path> find_server_program(const std::filesystem::path& named) {
  std::error_code failure;
  std::filesystem::path path = named;
  if (path.empty())
    path = std::filesystem::read_symlink("/proc/self/exe", failure).parent_path() / "strandcast-server";
  if (std::filesystem::is_regular_file(path, failure)) return std::filesystem::absolute(path, failure);
  return make_error(ErrorCode::NotFound, "there is no server program {}: name it with --server PATH",
                    path.string());
}

Status ServerProcess::spawn() {
  std::error_code ignored;
  std::filesystem::remove(config_.folder / "port", ignored);
  std::vector<std::string> words{config_.program.string()};
  words.insert(words.end(), config_.arguments.begin(), config_.arguments.end());
  const std::vector<std::string> own{
      "--port",       std::to_string(port_), "--port-file", (config_.folder / "port").string(),
      "--token-file", token_file().string(), "--seconds",   fmt::format("{:.1f}", config_.lifetime_s)};
  words.insert(words.end(), own.begin(), own.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const std::string log = log_file().string();
  const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
  // New tokens are shown on the standard output.
  const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, kOwnerOnly);
  int failed[2] = {-1, -1};  // closed by a program that starts; else it gets why not
  int failure = null < 0 || output < 0 || pipe2(failed, O_CLOEXEC) != 0 ? errno : 0;
  if (failure == 0) {
    process_ = fork();
    if (process_ == 0) become(pointers, {null, output, failed[1]});
    failure = process_ < 0 ? errno : 0;
  }
  if (failed[1] >= 0) close(failed[1]);
  if (failure == 0 && read(failed[0], &failure, sizeof failure) == sizeof failure)
    waitpid(process_, nullptr, 0);
  for (const int descriptor : {null, output, failed[0]})
    if (descriptor >= 0) close(descriptor);
  if (failure == 0) return most_file_bytes_ ? apply_file_limit() : Status();
  process_ = -1;
  return make_error(ErrorCode::NotFound, "cannot start {}: {} (--server PATH names the program)",
                    config_.program.string(), std::strerror(failure));
}

Status ServerProcess::limit_files(const std::optional<uint64_t>& most_bytes) {
  most_file_bytes_ = most_bytes;
  return apply_file_limit();
}

Status ServerProcess::apply_file_limit() const {
  rlimit limit{};
  bool is_set = process_ > 0 && prlimit(process_, RLIMIT_FSIZE, nullptr, &limit) == 0;
  limit.rlim_cur = most_file_bytes_ ? std::min<rlim_t>(*most_file_bytes_, limit.rlim_max) : limit.rlim_max;
  is_set = is_set && prlimit(process_, RLIMIT_FSIZE, &limit, nullptr) == 0;
  if (is_set) return {};
  return make_error(ErrorCode::Unavailable, "cannot limit the server's files: {}", std::strerror(errno));
}

bool ServerProcess::has_ended() {
  if (process_ < 0) return true;
  int status = 0;
  if (waitpid(process_, &status, WNOHANG) != process_) return false;
  has_refused_ = WIFEXITED(status) && WEXITSTATUS(status) == kBadInputExit;
  process_ = -1;
  return true;
}

std::string ServerProcess::last_line() const {
  std::ifstream log(log_file());
  std::string last = "it said nothing";
  for (std::string line; std::getline(log, line);)
    if (!line.empty()) last = line;
  return excerpt(last, kMaxShownChars);
}

std::vector<std::string> ServerProcess::said_of(const std::string& tag) const {
  std::ifstream log(log_file());
  const std::string mark = " [" + tag + "] ";
  std::vector<std::string> said;
  for (std::string line; std::getline(log, line);)
    if (const size_t at = line.find(mark); at != std::string::npos)
      said.push_back(one_line(line.substr(at + mark.size()), kMaxLogMessageChars));
  return said;
}

Status ServerProcess::wait_for_port(double timeout_s, const std::atomic<bool>& stop) {
  const int64_t end_ns = now_ns() + static_cast<int64_t>(timeout_s * 1e9);
  while (true) {
    if (const auto text = load_text(config_.folder / "port", kMaxPortFileBytes); text && !text->empty()) {
      uint16_t port = 0;
      if (std::from_chars(text->data(), text->data() + text->size(), port).ec == std::errc() && port != 0) {
        port_ = port;
        return {};
      }
    }
    if (has_ended())
      return make_error(has_refused_ ? ErrorCode::BadInput : ErrorCode::Unavailable,
                        "the server did not start: {}", last_line());
    if (stop) return make_error(ErrorCode::Unavailable, "stopped while the server started");
    if (now_ns() >= end_ns)
      return make_error(ErrorCode::Timeout, "the server did not serve within {:.0f} s: {}", timeout_s,
                        last_line());
    std::this_thread::sleep_for(kProcessPoll);
  }
}

Status ServerProcess::start(double timeout_s, const std::atomic<bool>& stop) {
  RETURN_IF_ERROR(spawn());
  Status served = wait_for_port(timeout_s, stop);
  if (!served) this->stop();
  return served;
}

Status ServerProcess::restart(double timeout_s, const std::atomic<bool>& stop) {
  if (process_ >= 0) {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  Status started;
  for (int i = 0; i < kRestarts && !stop; ++i) {
    started = start(timeout_s, stop);
    if (started || started.error().code == ErrorCode::Timeout) break;
    std::this_thread::sleep_for(kRestartPause);
  }
  return started;
}

void ServerProcess::stop() {
  if (has_ended()) return;
  kill(process_, SIGTERM);
  const int64_t end_ns = now_ns() + std::chrono::nanoseconds(kEndTimeout).count();
  while (now_ns() < end_ns) {
    if (has_ended()) return;
    std::this_thread::sleep_for(kProcessPoll);
  }
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  process_ = -1;
}

}  // namespace strandcast
