#include "client/app/viewer_thread.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace strandcast {
namespace {

/// Longest sleep while nothing arrives: how late a change of playout is noticed.
constexpr std::chrono::milliseconds kPumpWait{20};
constexpr double kMsPerNs = 1e-6;

}  // namespace

ViewerThread::ViewerThread(std::unique_ptr<LiveConnection> live)
    : live_(std::move(live)), modes_(live_->modes()) {
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
    state_ = std::move(state);
  }
  published_.notify_one();
}

void ViewerThread::receive() {
  while (!is_stopping_) {
    live_->session().replay().set_playout(playout_);
    if (live_->pump(kPumpWait)) ++session_number_;
    publish();
  }
}

void ViewerThread::publish() {
  ViewerSession& session = live_->session();
  const int64_t time_ns = now_ns();
  const ClockOffset clock = session.client().clock();
  auto state = std::make_shared<ViewerState>();
  state->session_number = session_number_;
  state->is_connected = live_->is_connected();
  state->trouble = live_->trouble();
  state->final_error = live_->final_error();
  state->welcome = session.welcome();
  state->asset = session.shared_asset();
  state->mode = modes_->look();
  state->timeline = session.replay().timeline();
  state->image = session.shared_image();
  state->image_count = session.image_count();
  state->quality = session.quality();
  state->quality_changes = session.quality_changes();
  state->status = session.status();
  state->has_status = session.has_status();
  state->net = session.client().counters();
  state->decoded_frames = session.decoded_frames();
  state->missed_frames = session.replay().stats().missed_frames + session.picture_stats().missed_frames;
  state->strand_decode_ms = session.replay().decode_timer().median_ms();
  state->picture_decode_ms = session.picture_decode_timer().median_ms();
  state->motion_to_decoded_ms = session.replay().motion_latency_timer().median_ms();
  state->playout_delay_ms = session.replay().playout_delay_ms();
  state->round_trip_ms = clock.has_value() ? 2.0 * static_cast<double>(clock.error_ns()) * kMsPerNs : 0.0;
  state->state_age_ms = session.replay().state_age_ms(time_ns, clock);
  state->made_ns = time_ns;
  std::vector<Notice> notices = session.take_notices();

  {
    const std::lock_guard lock(mutex_);
    state_ = std::move(state);
    client_ = session.shared_client();
    for (Notice& notice : notices) notices_.add(std::move(notice));
  }
  published_.notify_one();
}

std::shared_ptr<const ViewerState> ViewerThread::look() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<const ViewerState> ViewerThread::look(const std::shared_ptr<const ViewerState>& last,
                                                      std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  published_.wait_for(lock, timeout, [&] { return state_ != last; });
  return state_;
}

std::vector<Notice> ViewerThread::take_notices() {
  const std::lock_guard lock(mutex_);
  return notices_.take();
}

Status ViewerThread::send(const ClientMessage& message) {
  std::shared_ptr<ViewerClient> client;
  {
    const std::lock_guard lock(mutex_);
    client = client_;
  }
  return client->send(message);
}

void ViewerThread::request_mode(StreamMode mode) {
  modes_->want(mode);
  std::shared_ptr<ViewerClient> client;
  {
    const std::lock_guard lock(mutex_);
    client = client_;
  }
  send_mode_request(*modes_, *client);
}

ViewReport ViewerThread::stop_and_report() {
  stop();
  return make_report(live_->session());
}

}  // namespace strandcast
