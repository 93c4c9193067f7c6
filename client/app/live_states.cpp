#include "client/app/live_states.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr std::chrono::milliseconds kStatesPumpWait{20};
constexpr double kNoStateTimeoutS = 15.0;
constexpr double kNoStatusS = 2.0;  // after the first state; servers tell their status once a second

double seconds_since(int64_t then_ns) {
  return static_cast<double>(now_ns() - then_ns) * 1e-9;
}

}  // namespace

Result<std::unique_ptr<LiveStates>> LiveStates::open(const ClientConfig& config,
                                                     const std::atomic<bool>& stop) {
  ClientConfig whole = config;
  whole.keeps_all_strands = true;  // a file has rather fewer states than filled strands
  ASSIGN_OR_RETURN(auto live, LiveConnection::open(whole));
  std::unique_ptr<LiveStates> states(new LiveStates(std::move(live), stop));
  const int64_t begin_ns = now_ns();
  std::optional<int64_t> first_ns;
  const auto is_begun = [&] {
    const ViewerSession& session = states->live_->session();
    if (states->waiting_.empty() || session.asset() == nullptr) return false;
    if (!first_ns) first_ns = now_ns();
    return session.has_status() || seconds_since(*first_ns) > kNoStatusS;  // statuses have the timecode
  };
  while (!is_begun()) {
    if (stop) return make_error(ErrorCode::Unavailable, "stopped before the first state had come");
    if (seconds_since(begin_ns) > kNoStateTimeoutS)
      return make_error(ErrorCode::Timeout, "the server sent no state for {} s", kNoStateTimeoutS);
    RETURN_IF_ERROR(states->pump());
  }
  ViewerSession& session = states->live_->session();
  const LookDesc& look = session.look().look;
  states->counted_ = states->newest_counted();
  states->scene_ = {session.shared_asset(), look.strand_radius_m, look.tip_scale};
  return states;
}

LiveStates::LiveStates(std::unique_ptr<LiveConnection> live, const std::atomic<bool>& stop)
    : live_(std::move(live)), stop_(stop) {
  listen();
}

void LiveStates::listen() {
  live_->session().set_snapshot_listener([this](const auto& state) {
    // A server that was started anew begins at zero.
    if (state->sim_time_ns > last_ns_) waiting_.push_back(state);
    last_ns_ = std::max(last_ns_, state->sim_time_ns);
  });
}

/// Fails with what trying again does not mend, or if other hair came back.
Status LiveStates::pump() {
  if (live_->pump(kStatesPumpWait)) listen();
  if (live_->final_error()) return *live_->final_error();
  const SceneAsset* now = live_->session().asset();
  if (scene_.asset == nullptr || now == nullptr) return {};
  if (now->strand_count == scene_.asset->strand_count && now->vertex_count == scene_.asset->vertex_count)
    return {};
  return make_error(ErrorCode::Unavailable, "the server has other hair now: {} strands x {} vertices",
                    now->strand_count, now->vertex_count);
}

Result<std::shared_ptr<const Snapshot>> LiveStates::next() {
  const int64_t begin_ns = now_ns();
  while (waiting_.empty()) {
    if (stop_) return std::shared_ptr<const Snapshot>();
    if (seconds_since(begin_ns) > kNoStateTimeoutS)
      return make_error(ErrorCode::Timeout, "no new state for {} s ({})", kNoStateTimeoutS,
                        live_->is_connected() ? "is the server paused?" : live_->trouble());
    RETURN_IF_ERROR(pump());
  }
  std::shared_ptr<const Snapshot> state = std::move(waiting_.front());
  waiting_.pop_front();
  return state;
}

/// Of the newest status: its step says the simulated time.
std::optional<CountedState> LiveStates::newest_counted() const {
  ViewerSession& session = live_->session();
  const ServerStatus& status = session.status();
  if (!status.timecode) return std::nullopt;
  const double time_s = static_cast<double>(status.tick) / session.client().welcome().step_rate_hz;
  return CountedState{std::llround(time_s * kNsPerS), *status.timecode};
}

Result<std::optional<int64_t>> LiveStates::skip_to(double) {
  return std::optional(waiting_.front()->sim_time_ns);
}

std::optional<CountedState> LiveStates::counted() const {
  return counted_;
}

std::vector<std::string> LiveStates::remarks() const {
  std::vector<std::string> remarks;
  if (const auto now = newest_counted();
      counted_ && now && is_same_count(now->timecode, counted_->timecode)) {
    const double hz = now->timecode.rate.hz();
    const double passed = static_cast<double>(now->sim_time_ns - counted_->sim_time_ns) / kNsPerS * hz;
    if (std::abs(frames_between(advanced(counted_->timecode, passed), now->timecode)) > 1.0)
      remarks.emplace_back("the timecode jumped meanwhile: frames are counted on from its first");
  }
  SessionTotals totals = live_->earlier();
  totals += totals_of(live_->session());
  const uint64_t lost = totals.missed_frames + totals.dropped_by_client;
  if (lost > 0)
    remarks.push_back(
        fmt::format("{} states were lost on the way; the frames between are interpolated", lost));
  if (live_->outage_s() > 0.0)
    remarks.push_back(
        fmt::format("the server was away {:.1f} s; the frames of it are interpolated", live_->outage_s()));
  return remarks;
}

}  // namespace strandcast
