#include "client/app/baked_states.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/app/ctl_commands.h"
#include "client/app/save_scene.h"
#include "common/base/profile.h"
#include "common/math/turn.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr double kBakeStartS = 600.0;            // large hair on a loaded machine
constexpr double kBakeLifetimeS = 604'800.0;     // a week: whatever becomes of us, it does not stay for ever
constexpr int64_t kLastStateNs = 5'000'000'000;  // for the viewer, behind the steps
constexpr milliseconds kBakePump{5};
constexpr size_t kMostWaiting = 2;
constexpr double kSlopeS = 1e-3;  // over which a speed is taken

/// Where a motion would have come from, had it always had the speed of its start.
Pose before_start(const std::function<Pose(double)>& motion, double t_s) {
  const Pose start = motion(0.0), soon = motion(kSlopeS);
  const double share = t_s / kSlopeS;
  return {start.position_m + share * (soon.position_m - start.position_m),
          turned(start.rotation, share * turn_between(start.rotation, soon.rotation))};
}

}  // namespace

uint64_t steps_between(double step_rate_hz, double fps) {
  const double steps = step_rate_hz / fps, whole = std::round(steps);
  constexpr double kSameRate = 1e-9;
  return whole >= 1.0 && std::abs(steps - whole) < kSameRate * steps ? static_cast<uint64_t>(whole) : 1;
}

FeedPlan with_lead(FeedPlan plan, double lead_s) {
  if (lead_s <= 0.0) return plan;
  if (plan.motion)
    plan.motion = [motion = plan.motion, lead_s](double t_s) {
      if (t_s >= lead_s) return motion(t_s - lead_s);
      return before_start(motion, time_from_rest_s(t_s, lead_s) - 0.5 * lead_s);
    };
  const auto later = [lead_s](auto function) {
    return [function, lead_s](double t_s) { return function(std::max(t_s - lead_s, 0.0)); };
  };
  if (plan.joints) plan.joints = later(plan.joints);
  if (plan.wind) plan.wind = later(plan.wind);
  return plan;
}

Result<std::unique_ptr<BakedStates>> BakedStates::start(const std::filesystem::path& program,
                                                        std::vector<std::string> words,
                                                        const std::atomic<bool>& stop) {
  std::unique_ptr<BakedStates> states(new BakedStates(stop));
  if (const Status opened = states->open(program, std::move(words)); !opened)
    return states->ended(opened.error());
  return states;
}

BakedStates::~BakedStates() {
  session_.reset();
  client_.reset();
  server_.reset();
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

Status BakedStates::open(const std::filesystem::path& program, std::vector<std::string> words) {
  ASSIGN_OR_RETURN(folder_, make_temporary_folder());
  server_ = std::make_unique<ServerProcess>(
      ServerProcessConfig{program, std::move(words), folder_, kBakeLifetimeS});
  RETURN_IF_ERROR(server_->start(kBakeStartS, stop_));
  RETURN_IF_ERROR(connect());
  return await_scene();
}

void BakedStates::begin(const BakeFeed& feed) {
  const double step_rate_hz = client_->welcome().step_rate_hz;
  // The first state is one of the motion's start, so the lead takes whole steps.
  first_tick_ = static_cast<uint64_t>(std::ceil(feed.lead_s * step_rate_hz));
  stride_ = steps_between(step_rate_hz, feed.fps);
  feed_ = std::make_unique<SteppedFeed>(with_lead(feed.plan, static_cast<double>(first_tick_) / step_rate_hz),
                                        0, step_rate_hz);
  if (first_tick_ > 0) waiting_.clear();
}

/// One connection steps and feeds, so that samples and steps come in order. The other gets the strands.
Status BakedStates::connect() {
  const CtlTarget target{
      fmt::format("127.0.0.1:{}", server_->port()), {}, server_->token_file(), false, {}, &stop_, {}};
  ASSIGN_OR_RETURN(ClientConfig admin, client_config_for(target, Role::Admin));
  admin.hello.gets_no_stream = true;
  ASSIGN_OR_RETURN(client_, ViewerClient::connect(admin));
  ASSIGN_OR_RETURN(ClientConfig viewer, client_config_for(target, Role::Viewer));
  viewer.keeps_all_strands = true;  // steps wait for states, however long those take
  ASSIGN_OR_RETURN(session_, ViewerSession::open(viewer));
  session_->set_snapshot_listener([this](const std::shared_ptr<const Snapshot>& state) {
    seen_tick_ = state->tick;
    if (state->tick >= first_tick_ && (state->tick - first_tick_) % stride_ == 0) waiting_.push_back(state);
  });
  return {};
}

/// Until scene, shape and the first state are there.
Status BakedStates::await_scene() {
  RETURN_IF_ERROR(client_->send(SceneRequest{}));
  bool has_scene = false;
  while (!has_scene || session_->asset() == nullptr || waiting_.empty()) {
    if (stop_) return make_error(ErrorCode::Unavailable, "stopped before the first state had come");
    for (const ClientEvent& event : client_->wait(kBakePump)) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
      if (const auto* text = std::get_if<SceneText>(&event)) {
        ASSIGN_OR_RETURN(simulated_, scene_of(*text));
        has_scene = true;
      }
    }
    RETURN_IF_ERROR(session_->pump(kBakePump));
  }
  const LookDesc& look = session_->look().look;
  scene_ = {session_->shared_asset(), look.strand_radius_m, look.tip_scale};
  return {};
}

/// Asks for steps once the state that the last ones led to is here: those between would be left out, as a
/// viewer gets the newest. A state that is lost on the way is waited for a while.
Status BakedStates::take_steps() {
  if (done_tick_ < asked_tick_ || waiting_.size() >= kMostWaiting) return {};
  if (seen_tick_ < asked_tick_) {
    if (now_ns() - done_ns_ < kLastStateNs) return {};
    ++lost_;
    seen_tick_ = asked_tick_;
  }
  const uint64_t count = asked_tick_ < first_tick_ ? first_tick_ - asked_tick_ : stride_;
  asked_tick_ += count;
  for (const ClientMessage& samples : feed_->samples_up_to(asked_tick_))
    RETURN_IF_ERROR(client_->send(samples));
  return client_->send(ControlCommand{Command::StepOnce, static_cast<uint32_t>(count)});
}

Status BakedStates::pump(milliseconds timeout) {
  for (const ClientEvent& event : client_->poll()) {
    if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
    const auto* notice = std::get_if<Notice>(&event);
    if (notice == nullptr) continue;
    if (notice->is_error) return make_error(ErrorCode::Unavailable, "the server says: {}", notice->text);
    if (notice->tick <= done_tick_) continue;
    done_tick_ = notice->tick;
    done_ns_ = now_ns();
  }
  return session_->pump(timeout);
}

std::vector<std::string> BakedStates::hair_notes() const {
  return server_->said_of("scene");
}

/// A server that has ended has said why.
Error BakedStates::ended(const Error& error) {
  if (server_ == nullptr || stop_ || client_ == nullptr || !server_->has_ended()) return error;
  return make_error(ErrorCode::Unavailable, "the server has ended: {}", server_->last_line());
}

Result<std::shared_ptr<const Snapshot>> BakedStates::next() {
  while (true) {
    if (stop_) return make_error(ErrorCode::Unavailable, "stopped");
    if (const Status pumped = pump(waiting_.empty() ? kBakePump : milliseconds(0)); !pumped)
      return ended(pumped.error());
    if (const Status taken = take_steps(); !taken) return ended(taken.error());
    if (waiting_.empty()) continue;
    // In the time of the motion, which is behind the lead.
    auto state = std::make_shared<Snapshot>(*waiting_.front());
    waiting_.pop_front();
    if (!first_ns_) first_ns_ = state->sim_time_ns;
    state->sim_time_ns -= *first_ns_;
    return std::shared_ptr<const Snapshot>(std::move(state));
  }
}

std::vector<std::string> BakedStates::remarks() const {
  if (lost_ == 0) return {};
  return {fmt::format("{} states were lost on the way; the frames between are interpolated", lost_)};
}

}  // namespace strandcast
