#include "client/app/steady_client.h"

namespace strandcast {
namespace {

constexpr std::chrono::milliseconds kAwaitPump{20};

}  // namespace

Status SteadyClient::pump(std::chrono::milliseconds timeout, const OnEvent& on_event) {
  if (client_ == nullptr) {
    if (attempts_.final_error()) return *attempts_.final_error();
    client_ = attempts_.pump(timeout);
    if (client_ != nullptr) welcome_ = client_->welcome();
    if (attempts_.final_error()) return *attempts_.final_error();
    return {};
  }
  for (ClientEvent& event : client_->wait(timeout)) {
    if (const auto* closed = std::get_if<ClosedEvent>(&event)) {
      attempts_.lose(closed->error, client_->heard_ns());
      client_.reset();
      away_since_ns_ = 0;
      if (attempts_.final_error()) return *attempts_.final_error();
      return {};
    }
    if (const auto* status = std::get_if<ServerStatus>(&event)) {
      Heard heard;
      hear(heard, status->away_s, now_ns());
      away_since_ns_ = heard.away_since_ns;
    }
    on_event(event);
  }
  if (auto next = attempts_.pump_beside(heard())) {
    away_since_ns_ = 0;
    client_ = std::move(next);
    welcome_ = client_->welcome();
  }
  return {};
}

Status SteadyClient::await_welcome(const std::atomic<bool>& stop, std::chrono::milliseconds limit) {
  const auto begin = std::chrono::steady_clock::now();
  while (client_ == nullptr) {
    if (stop) return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
    // Its largest value is more nanoseconds than there are.
    const auto waited = std::chrono::steady_clock::now() - begin;
    if (std::chrono::duration_cast<std::chrono::milliseconds>(waited) >= limit)
      return attempts_.last_error()
                 ? *attempts_.last_error()
                 : make_error(ErrorCode::Timeout, "the server did not answer within {} ms", limit.count());
    RETURN_IF_ERROR(pump(kAwaitPump, {}));
  }
  return {};
}

}  // namespace strandcast
