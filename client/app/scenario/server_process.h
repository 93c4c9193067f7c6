// ServerProcess: strandcast-server as a child process on a free port, with its own tokens and its output in a
// file. It always ends with its owner, also where that is killed. One thread.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Returns the server program: this path, or strandcast-server beside this program if it is empty. NotFound
/// if it is no file.
Result<std::filesystem::path> find_server_program(const std::filesystem::path& path);

/// Makes a folder that nobody else has; the caller removes it.
Result<std::filesystem::path> make_temporary_folder();

struct ServerProcessConfig {
  std::filesystem::path program;
  std::vector<std::string> arguments;  // all but port, files and lifetime
  std::filesystem::path folder;        // its port file, token file and output; exists
  double lifetime_s = 3'600.0;         // it ends by itself after so long, whatever becomes of us
};

class ServerProcess {
 public:
  explicit ServerProcess(ServerProcessConfig config) : config_(std::move(config)) {}
  ~ServerProcess() { stop(); }
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  /// Starts the server and waits until it serves. Returns the server's own error if it ends instead, Timeout,
  /// or Unavailable if `stop` is set.
  Status start(double timeout_s, const std::atomic<bool>& stop);
  /// Kills the server and starts it again on the same port.
  Status restart(double timeout_s, const std::atomic<bool>& stop);
  /// Asks the server to end, and kills it if it does not.
  void stop();

  /// Limits the size of each file of the server from now on, also after restart(); empty = none.
  /// Unavailable where the system refuses.
  Status limit_files(const std::optional<uint64_t>& most_bytes);

  bool has_ended();
  uint16_t port() const { return port_; }
  /// Returns what the server said last, for a person.
  std::string last_line() const;
  /// Returns what it has logged of one stage so far, a sentence each.
  std::vector<std::string> said_of(const std::string& tag) const;
  std::filesystem::path token_file() const { return config_.folder / "tokens"; }
  std::filesystem::path log_file() const { return config_.folder / "server.log"; }

 private:
  Status spawn();
  Status apply_file_limit() const;
  Status wait_for_port(double timeout_s, const std::atomic<bool>& stop);

  const ServerProcessConfig config_;
  pid_t process_ = -1;        // -1 = none
  bool has_refused_ = false;  // its arguments or scene, as its exit code said
  uint16_t port_ = 0;
  std::optional<uint64_t> most_file_bytes_;
};

}  // namespace strandcast
