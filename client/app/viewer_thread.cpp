#include "client/app/viewer_thread.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "common/base/units.h"

namespace strandcast {
namespace {

/// Longest sleep while nothing arrives: how late a change of playout is noticed.
constexpr std::chrono::milliseconds kThreadPumpWait{20};

}  // namespace

ViewerThread::ViewerThread(std::unique_ptr<LiveConnection> live, NewsListener listener)
    : live_(std::move(live)),
      modes_(live_->modes()),
      listener_(std::move(listener)),
      session_number_(live_->has_session() ? 1 : 0) {
  publish();
  thread_ = std::thread([this] { run(); });
}

ViewerThread::~ViewerThread() {
  stop();
}

void ViewerThread::stop() {
  is_stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void ViewerThread::run() {
  try {
    receive();
  } catch (const std::exception& failure) {
    fail(failure.what());
  }
}

/// Out of memory, say: the last state stays, with the reason.
void ViewerThread::fail(const std::string& what) {
  auto state = std::make_shared<ViewerState>(*look());
  state->is_connected = false;
  state->final_error = make_error(ErrorCode::Internal, "the receiving thread failed: {}", what);
  state->trouble = state->final_error->to_string();
  {
    const std::lock_guard lock(mutex_);
    state_ = state;
  }
  if (listener_) listener_(state);
}

void ViewerThread::receive() {
  while (!is_stopping_) {
    if (live_->has_session()) live_->session().replay().set_playout(playout_);
    if (live_->pump(kThreadPumpWait)) ++session_number_;
    publish();
  }
}

void ViewerThread::publish() {
  auto state = std::make_shared<ViewerState>();
  state->session_number = session_number_;
  state->is_connected = live_->is_connected();
  state->trouble = live_->trouble();
  state->help = live_->help();
  state->doing = live_->doing();
  state->final_error = live_->final_error();
  state->mode = modes_->look();
  if (live_->has_session()) describe(*state);
  {
    const std::lock_guard lock(mutex_);
    state_ = state;
    if (live_->has_session()) {
      client_ = live_->session().shared_client();
      for (Notice& notice : live_->session().take_notices()) notices_.add(std::move(notice));
      if (auto scene = live_->session().take_scene()) scene_ = std::move(scene);
    }
  }
  if (listener_) listener_(state);
}

void ViewerThread::describe(ViewerState& state) {
  ViewerSession& session = live_->session();
  const int64_t time_ns = now_ns();
  const ClockOffset clock = session.client().clock();
  state.welcome = session.welcome();
  state.asset = session.shared_asset();
  state.timeline = session.replay().timeline();
  state.image = session.shared_image();
  state.image_count = session.image_count();
  state.image_sim_time_ns = session.image_sim_time_ns();
  state.quality = session.quality();
  state.quality_changes = session.quality_changes();
  state.look = session.look();
  state.look_changes = session.look_changes();
  state.parameters = session.parameters();
  state.moved_camera = session.moved_camera();
  state.camera_moves = session.camera_moves();
  state.status = session.status();
  state.has_status = session.has_status();
  state.net = session.client().counters();
  state.decoded_frames = session.decoded_frames();
  const ReplayStats& strands = session.replay().stats();
  state.exact_share = strands.decoded_frames == 0 ? 0.0
                                                  : static_cast<double>(strands.exact_frames) /
                                                        static_cast<double>(strands.decoded_frames);
  state.wrong_states = strands.wrong_states;
  state.missed_frames = session.replay().stats().missed_frames + session.picture_stats().missed_frames;
  state.strand_decode_ms = session.replay().decode_timer().median_ms();
  state.picture_decode_ms = session.picture_decode_timer().median_ms();
  state.motion_to_decoded_ms = session.motion_latency_timer().median_ms();
  state.playout_delay_ms = session.replay().playout_delay_ms();
  state.round_trip_ms = clock.has_value() ? 2.0 * static_cast<double>(clock.error_ns()) * kMsPerNs : 0.0;
  if (clock.has_value()) state.server_clock_offset_ns = clock.offset_ns();
  state.state_age_ms = session.replay().state_age_ms(time_ns, clock);
  state.made_ns = time_ns;
}

std::shared_ptr<const ViewerState> ViewerThread::look() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::vector<Notice> ViewerThread::take_notices() {
  const std::lock_guard lock(mutex_);
  return notices_.take();
}

std::optional<SceneText> ViewerThread::take_scene() {
  const std::lock_guard lock(mutex_);
  return std::exchange(scene_, std::nullopt);
}

std::shared_ptr<ViewerClient> ViewerThread::client() const {
  const std::lock_guard lock(mutex_);
  return client_;
}

Status ViewerThread::send(const ClientMessage& message) {
  const auto running = client();
  if (running == nullptr) return make_error(ErrorCode::Unavailable, "there is no connection yet");
  return running->send(message);
}

void ViewerThread::request_mode(StreamMode mode) {
  modes_->want(mode);
  // Without a session the Hello of the first will say it.
  if (const auto running = client()) send_mode_request(*modes_, *running);
}

std::optional<ViewReport> ViewerThread::stop_and_report() {
  stop();
  if (!live_->has_session()) return std::nullopt;
  return make_report(live_->session(), scope_of(*live_));
}

}  // namespace strandcast
