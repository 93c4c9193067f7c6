// Attempts: connects, and connects again after a loss, as ReconnectPolicy has it, beside the caller's thread.
// What a session is, its caller knows. One thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "common/base/profile.h"
#include "common/client/reconnect_policy.h"
#include "common/client/viewer_client.h"
#include "common/log/log.h"

namespace strandcast {

/// Blocks until a connection is there, `patience` is over or an error is final: the last error then, or what
/// config.cancel says. Member: somebody who has been in it before.
Result<std::unique_ptr<ViewerClient>> connect_patiently(const ClientConfig& config,
                                                        std::chrono::milliseconds patience = kCommandPatience,
                                                        Standing standing = Standing::Newcomer);

template <class Session>
class Attempts {
 public:
  using Open = std::function<Result<std::unique_ptr<Session>>(const ClientConfig&)>;

  /// Nothing is tried before pump().
  Attempts(const ClientConfig& config, Open open, std::chrono::milliseconds longest = kLongestReconnectDelay)
      : config_(config), open_(std::move(open)), policy_(static_cast<uint32_t>(now_ns()), longest) {
    config_.on_step = [this](ConnectStep step) { step_ = step; };
    config_.cancel = [this, cancel = config.cancel]() -> std::optional<Error> {
      if (is_leaving_) return make_error(ErrorCode::Unavailable, "this program is leaving");
      if (is_unneeded_) return make_error(ErrorCode::Unavailable, "the connection of before speaks again");
      return cancel ? cancel() : std::nullopt;
    };
  }
  /// Gives up an attempt that is under way.
  ~Attempts() { is_leaving_ = true; }
  Attempts(const Attempts&) = delete;
  Attempts& operator=(const Attempts&) = delete;

  /// Where there is no session: waits up to `timeout`, begins what is due, and gives what has come of it.
  std::unique_ptr<Session> pump(std::chrono::milliseconds timeout) {
    is_unneeded_ = false;
    if (!attempt_.valid()) {
      if (!final_error_ && now_ns() >= next_ns_)
        begin();
      else
        std::this_thread::sleep_for(timeout);
      return nullptr;
    }
    if (attempt_.wait_for(timeout) != std::future_status::ready) return nullptr;
    auto opened = attempt_.get();
    if (!opened) {
      lose(opened.error(), 0);
      return nullptr;
    }
    note_welcome();
    log_info("net", "connected to {}", config_.address.to_string());
    return std::move(opened).value();
  }
  /// Where there is one: as pump(), without waiting, while the connection is doubted. Call it often: who
  /// stood still itself has heard nothing meanwhile.
  std::unique_ptr<Session> pump_beside(const Heard& heard) {
    const int64_t time_ns = now_ns();
    const bool was_awake = !is_doubted(std::exchange(looked_ns_, time_ns), time_ns);
    is_unneeded_ = !is_doubted(heard.last_ns, time_ns);
    policy_.on_heard(heard, time_ns);
    const bool was_told = std::exchange(is_silence_told_, silent_since_ns(heard, time_ns) != 0);
    if (!was_told && is_silence_told_)
      log_warn("net", "{}", silence_text(config_.address.to_string(), heard, time_ns));
    if (!attempt_.valid()) {
      if (!is_unneeded_ && was_awake && time_ns >= next_ns_) begin();
      return nullptr;
    }
    if (attempt_.wait_for(std::chrono::milliseconds(0)) != std::future_status::ready) return nullptr;
    auto opened = attempt_.get();
    if (is_unneeded_) return nullptr;
    if (!opened) {
      const auto delay = policy_.on_failed(opened.error());
      // What is final is told once nothing else is left.
      next_ns_ = time_ns + std::chrono::nanoseconds(delay.value_or(kLongestReconnectDelay)).count();
      log_debug("net", "beside a silent connection: {}", opened.error().to_string());
      return nullptr;
    }
    policy_.on_lost(make_error(ErrorCode::Timeout, "silent"), time_ns, heard.last_ns);
    note_welcome();
    log_info("net", "connected to {} anew, since nothing came any more", config_.address.to_string());
    return std::move(opened).value();
  }
  /// A session was opened without this one.
  void note_welcome() {
    policy_.on_welcome(now_ns());
    is_silence_told_ = false;
    step_ = ConnectStep::AwaitWelcome;  // it had all of them
  }

  /// The session ended; `heard_ns`: when something came last (0: just now).
  void lose(const Error& error, int64_t heard_ns) {
    last_error_ = error;
    const auto delay = policy_.on_lost(error, now_ns(), heard_ns);
    if (!delay) {
      final_error_ = error;
      log_error("net", "{}", error.to_string());
      return;
    }
    next_ns_ = now_ns() + std::chrono::nanoseconds(*delay).count();
    log_warn("net", "{}; next attempt in {} ms", error.to_string(), delay->count());
  }

  /// Returns the configuration of the next attempt.
  ClientConfig& config() { return config_; }
  const ClientConfig& config() const { return config_; }
  const ReconnectPolicy& policy() const { return policy_; }
  /// Returns the step that the current or last attempt reached.
  ConnectStep step() const { return step_; }
  const std::optional<Error>& last_error() const { return last_error_; }
  /// Returns the reason if another attempt cannot help; empty otherwise.
  const std::optional<Error>& final_error() const { return final_error_; }
  /// What is being done, for a person; empty when trying again cannot help.
  std::string doing() const {
    if (final_error_) return {};
    const uint32_t number = policy_.attempts() + (attempt_.valid() ? 1 : 0);
    const std::string count = number > 1 ? fmt::format(" (attempt {})", number) : std::string();
    if (attempt_.valid()) return to_string(step_.load()) + count;
    const double wait_s = static_cast<double>(next_ns_ - now_ns()) * 1e-9;
    return fmt::format("trying again in {:.0f} s{}", std::max(std::ceil(wait_s), 0.0), count);
  }

 private:
  void begin() {
    attempt_ = std::async(std::launch::async, [open = open_, config = config_] { return open(config); });
  }

  std::atomic<bool> is_leaving_{false};
  std::atomic<bool> is_unneeded_{false};
  std::atomic<ConnectStep> step_{ConnectStep::FindHost};
  ClientConfig config_;
  const Open open_;
  ReconnectPolicy policy_;
  int64_t next_ns_ = 0;
  int64_t looked_ns_ = 0;  // by pump_beside()
  bool is_silence_told_ = false;
  std::optional<Error> last_error_;
  std::optional<Error> final_error_;
  // Last: its end waits for what is under way, which reads the others.
  std::future<Result<std::unique_ptr<Session>>> attempt_;
};

}  // namespace strandcast
