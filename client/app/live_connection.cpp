#include "client/app/live_connection.h"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "client/app/way_out.h"
#include "common/log/log.h"

namespace strandcast {

Result<std::unique_ptr<LiveConnection>> LiveConnection::open(const ClientConfig& config) {
  ASSIGN_OR_RETURN(auto session, ViewerSession::open(config));
  return std::unique_ptr<LiveConnection>(new LiveConnection(config, std::move(session)));
}

std::unique_ptr<LiveConnection> LiveConnection::begin(const ClientConfig& config) {
  return std::unique_ptr<LiveConnection>(new LiveConnection(config, nullptr));
}

LiveConnection::LiveConnection(const ClientConfig& config, std::unique_ptr<ViewerSession> session)
    : config_(config),
      modes_(std::make_shared<ModeControl>(config.hello.mode)),
      session_(std::move(session)),
      policy_(static_cast<uint32_t>(now_ns())),
      is_connected_(session_ != nullptr) {
  if (session_ != nullptr) {
    session_->follow(modes_);
    step_ = ConnectStep::AwaitWelcome;  // it had all of them
  }
  config_.on_step = [this](ConnectStep step) { step_ = step; };
  config_.cancel = [this, cancel = config.cancel]() -> std::optional<Error> {
    if (is_leaving_) return make_error(ErrorCode::Unavailable, "the viewer is leaving");
    return cancel ? cancel() : std::nullopt;
  };
}

LiveConnection::~LiveConnection() {
  is_leaving_ = true;
}

void LiveConnection::set_trace(std::shared_ptr<FrameTrace> trace) {
  trace_ = std::move(trace);
  if (session_ != nullptr) session_->set_trace(trace_);
}

bool LiveConnection::pump(std::chrono::milliseconds timeout) {
  if (is_connected_) {
    if (auto pumped = session_->pump(timeout); !pumped) lose(pumped.error());
    return false;
  }
  if (!attempt_.valid()) {
    if (!final_error_ && Clock::now() >= next_attempt_) start_attempt();
    std::this_thread::sleep_for(timeout);
    return false;
  }
  if (attempt_.wait_for(timeout) != std::future_status::ready) return false;
  auto opened = attempt_.get();
  if (!opened) {
    lose(opened.error());
    return false;
  }
  session_ = std::move(opened).value();
  is_connected_ = true;
  attempts_ = 0;
  session_->follow(modes_);
  session_->set_trace(trace_);
  log_info("net", "connected to {}", config_.address.to_string());
  return true;
}

void LiveConnection::lose(const Error& error) {
  const double lived_s = is_connected_ ? session_->connected_s() : 0.0;
  is_connected_ = false;
  last_error_ = error;
  const auto delay =
      policy_.next_delay(error, std::chrono::milliseconds(static_cast<int64_t>(lived_s * 1e3)));
  if (!delay) {
    final_error_ = error;
    log_error("net", "{}", error.to_string());
    return;
  }
  next_attempt_ = Clock::now() + *delay;
  log_warn("net", "{}; next attempt in {} ms", error.to_string(), delay->count());
}

void LiveConnection::start_attempt() {
  ++attempts_;
  config_.hello.mode = modes_->look().wanted;
  attempt_ = std::async(std::launch::async, [config = config_] { return ViewerSession::open(config); });
}

std::string LiveConnection::trouble() const {
  return is_connected_ || !last_error_ ? std::string() : last_error_->to_string();
}

std::string LiveConnection::help() const {
  return is_connected_ || !last_error_ ? std::string() : way_out(*last_error_, step_, config_.address);
}

std::string LiveConnection::doing() const {
  if (is_connected_ || final_error_) return {};
  const std::string count = attempts_ > 1 ? fmt::format(" (attempt {})", attempts_) : std::string();
  if (attempt_.valid()) return to_string(step_.load()) + count;
  const double wait_s = std::chrono::duration<double>(next_attempt_ - Clock::now()).count();
  return fmt::format("trying again in {:.0f} s{}", std::max(std::ceil(wait_s), 0.0), count);
}

}  // namespace strandcast
