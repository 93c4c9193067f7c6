#include "client/app/live_states.h"

#include <utility>

namespace strandcast {
namespace {

constexpr std::chrono::milliseconds kStatesPumpWait{20};
constexpr double kNoStateTimeoutS = 15.0;

}  // namespace

Result<std::unique_ptr<LiveStates>> LiveStates::open(const ClientConfig& config,
                                                     const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(auto session, ViewerSession::open(config));
  std::unique_ptr<LiveStates> states(new LiveStates(std::move(session), stop));
  const int64_t begin_ns = now_ns();
  while (states->waiting_.empty() || states->session_->asset() == nullptr) {
    if (stop) return make_error(ErrorCode::Unavailable, "stopped before the first state had come");
    if (static_cast<double>(now_ns() - begin_ns) * 1e-9 > kNoStateTimeoutS)
      return make_error(ErrorCode::Timeout, "the server sent no state for {} s", kNoStateTimeoutS);
    RETURN_IF_ERROR(states->session_->pump(kStatesPumpWait));
  }
  const LookDesc& look = states->session_->look().look;
  states->scene_ = {states->session_->shared_asset(), look.strand_radius_m, look.tip_scale};
  return states;
}

LiveStates::LiveStates(std::unique_ptr<ViewerSession> session, const std::atomic<bool>& stop)
    : session_(std::move(session)), stop_(stop) {
  session_->set_snapshot_listener([this](const auto& state) { waiting_.push_back(state); });
}

Result<std::shared_ptr<const Snapshot>> LiveStates::next() {
  const int64_t begin_ns = now_ns();
  while (waiting_.empty()) {
    if (stop_) return std::shared_ptr<const Snapshot>();
    if (static_cast<double>(now_ns() - begin_ns) * 1e-9 > kNoStateTimeoutS)
      return make_error(ErrorCode::Timeout, "no new state for {} s (is the server paused?)",
                        kNoStateTimeoutS);
    RETURN_IF_ERROR(session_->pump(kStatesPumpWait));
  }
  std::shared_ptr<const Snapshot> state = std::move(waiting_.front());
  waiting_.pop_front();
  return state;
}

std::vector<std::string> LiveStates::remarks() const {
  std::vector<std::string> remarks;
  const uint64_t lost =
      session_->replay().stats().missed_frames + session_->client().counters().dropped_frames;
  if (lost > 0)
    remarks.push_back(
        fmt::format("{} states were lost on the way; the frames between are interpolated", lost));
  return remarks;
}

}  // namespace strandcast
