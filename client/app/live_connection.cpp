#include "client/app/live_connection.h"

#include <utility>

#include "client/app/way_out.h"
#include "common/base/units.h"

namespace strandcast {

Result<std::unique_ptr<LiveConnection>> LiveConnection::open(const ClientConfig& config) {
  auto live = begin(config);
  ASSIGN_OR_RETURN(auto session, ViewerSession::open(config));
  live->attempts_.note_welcome();
  live->take(std::move(session));
  return live;
}

std::unique_ptr<LiveConnection> LiveConnection::begin(const ClientConfig& config) {
  return std::unique_ptr<LiveConnection>(new LiveConnection(config));
}

LiveConnection::LiveConnection(const ClientConfig& config)
    : modes_(std::make_shared<ModeControl>(config.hello.mode)),
      attempts_(config, [modes = modes_](ClientConfig one) {
        one.hello.mode = modes->look().wanted;
        return ViewerSession::open(one);
      }) {}

void LiveConnection::set_trace(std::shared_ptr<FrameTrace> trace) {
  trace_ = std::move(trace);
  if (session_ != nullptr) session_->set_trace(trace_);
}

void LiveConnection::take(std::unique_ptr<ViewerSession> session) {
  if (session_ != nullptr) earlier_ += totals_of(*session_);
  session_ = std::move(session);
  is_open_ = true;
  session_->follow(modes_);
  session_->set_trace(trace_);
}

bool LiveConnection::pump(std::chrono::milliseconds timeout) {
  if (is_open_) {
    const Status pumped = session_->pump(timeout);
    if (!pumped) {
      is_open_ = false;
      attempts_.lose(pumped.error(), session_->client().heard_ns());
      return false;
    }
    auto next = attempts_.pump_beside(session_->heard());
    if (next == nullptr) return false;
    take(std::move(next));
    return true;
  }
  auto session = attempts_.pump(timeout);
  if (session == nullptr) return false;
  take(std::move(session));
  return true;
}

std::string LiveConnection::trouble() const {
  if (is_connected()) return {};
  if (is_silent()) return silence_text(attempts_.config().address.to_string(), session_->heard(), now_ns());
  return attempts_.last_error() ? attempts_.last_error()->to_string() : std::string();
}

std::string LiveConnection::help() const {
  return is_open_ || !attempts_.last_error()
             ? std::string()
             : way_out(*attempts_.last_error(), attempts_.step(), attempts_.config().address);
}

std::string LiveConnection::doing() const {
  return is_connected() ? std::string() : attempts_.doing();
}

}  // namespace strandcast
