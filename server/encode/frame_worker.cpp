#include "server/encode/frame_worker.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/base/log.h"

namespace strandcast {
namespace {

// Strand frames that may wait while a picture is drawn; beyond it a keyframe is cheaper than catching up.
constexpr size_t kMaxPendingFrames = 256;
constexpr size_t kMaxPendingBytes = 64u << 20;
constexpr double kMsPerNs = 1e-6;
constexpr double kNsPerS = 1e9;
constexpr int kFrameThreadNice = 10;

/// Whether other views can still be drawn: this one is too large, say, or its camera impossible.
bool concerns_view_only(const Error& error) {
  return error.code == ErrorCode::BadInput || error.code == ErrorCode::LimitExceeded;
}

double ms_since(int64_t begin_ns) {
  return static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
}

}  // namespace

FrameWorker::FrameWorker(std::unique_ptr<StrandDecoder> decoder, MakePicturePainter make_painter,
                         double frame_rate_hz, Hooks hooks)
    : decoder_(std::move(decoder)),
      make_painter_(std::move(make_painter)),
      frame_interval_ns_(static_cast<int64_t>(kNsPerS / frame_rate_hz)),
      hooks_(std::move(hooks)),
      thread_([this] { run(); }) {}

FrameWorker::~FrameWorker() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FrameWorker::offer(EncodedFramePtr strand_frame) {
  {
    const std::lock_guard lock(mutex_);
    if (!can_draw()) return;
    const bool is_keyframe = strand_frame->header.opcode == Opcode::StrandKeyframe;
    const size_t bytes = strand_frame->message.size();
    // A keyframe stands for all before it. When too much waits, the chain breaks here; the decoder will
    // notice.
    if (is_keyframe || pending_.size() >= kMaxPendingFrames || pending_bytes_ + bytes > kMaxPendingBytes) {
      pending_.clear();
      pending_bytes_ = 0;
    }
    pending_bytes_ += bytes;
    pending_.push_back(std::move(strand_frame));
  }
  changed_.notify_all();
}

void FrameWorker::set_views(std::map<uint32_t, PictureView> views) {
  {
    const std::lock_guard lock(mutex_);
    views_ = std::move(views);
    has_new_views_ = true;
    if (views_.empty()) {
      pending_.clear();
      pending_bytes_ = 0;
    }
  }
  changed_.notify_all();
}

bool FrameWorker::has_views() const {
  const std::lock_guard lock(mutex_);
  return can_draw();
}

std::optional<Error> FrameWorker::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

FrameCounters FrameWorker::counters() const {
  const std::lock_guard lock(mutex_);
  FrameCounters counters = counters_;
  counters.paint_median_ms = paint_timer_.median_ms();
  counters.jpeg_median_ms = jpeg_timer_.median_ms();
  return counters;
}

void FrameWorker::run() {
  // Drawing in software takes every core it gets; the simulation goes first. On Linux this is the thread's
  // own value, and the driver's threads inherit it.
  setpriority(PRIO_PROCESS, 0, kFrameThreadNice);
  while (true) {
    const Job job = wait_for_job();
    if (job.is_stopping) break;
    if (job.views.empty()) {
      rest();
      continue;
    }
    if (!is_active_) begin();
    update_views(job.views);
    decode(job.strand_frames);
    const auto due = next_due();
    if (!due || due->time_ns > now_ns()) continue;
    if (const Status drawn = draw(due->picture_class); !drawn) {
      if (concerns_view_only(drawn.error()))
        refuse(due->picture_class, drawn.error());
      else
        fail(drawn.error());
    }
  }
  painter_.reset();  // on the thread that owns its context
}

FrameWorker::Job FrameWorker::wait_for_job() {
  std::unique_lock lock(mutex_);
  while (true) {
    const bool has_news = is_stopping_ || can_draw() != is_active_ || has_new_views_ || !pending_.empty();
    const auto due = is_active_ ? next_due() : std::nullopt;
    const int64_t wait_ns = due ? due->time_ns - now_ns() : 1;
    if (has_news || wait_ns <= 0) break;
    if (due)
      changed_.wait_for(lock, std::chrono::nanoseconds(wait_ns));
    else
      changed_.wait(lock);
  }
  has_new_views_ = false;
  pending_bytes_ = 0;
  Job job{std::exchange(pending_, {}), {}, is_stopping_};
  if (can_draw()) job.views = views_;
  return job;
}

void FrameWorker::begin() {
  is_active_ = true;
  is_chain_lost_ = true;
  hooks_.request_keyframe();
}

void FrameWorker::rest() {
  is_active_ = false;
  painter_.reset();
  snapshot_.reset();
  drawn_.clear();
}

void FrameWorker::update_views(const std::map<uint32_t, PictureView>& views) {
  std::erase_if(drawn_, [&](const auto& entry) { return !views.contains(entry.first); });
  for (const auto& [picture_class, view] : views) {
    Drawn& drawn = drawn_[picture_class];
    if (!(drawn.view == view)) {  // another camera: draw the same state again
      drawn.decode_count = 0;
      drawn.is_refused = false;
    }
    drawn.view = view;
  }
}

void FrameWorker::decode(const std::deque<EncodedFramePtr>& strand_frames) {
  uint64_t decoded = 0, losses = 0;
  for (const EncodedFramePtr& frame : strand_frames) {
    if (is_chain_lost_ && frame->header.opcode != Opcode::StrandKeyframe) continue;
    auto snapshot = decoder_->decode(frame->message);
    is_chain_lost_ = !snapshot;
    if (!snapshot) {
      ++losses;
      log_warn("render", "strand frame {}: {}; waiting for a keyframe", frame->header.sequence,
               snapshot.error().to_string());
      continue;
    }
    snapshot_ = std::move(snapshot).value();
    ++decode_count_;
    ++decoded;
  }
  // Also when a keyframe that was asked for has been crowded out of the queue since.
  if (is_chain_lost_ && !strand_frames.empty()) hooks_.request_keyframe();
  const std::lock_guard lock(mutex_);
  counters_.decoded += decoded;
  counters_.chain_losses += losses;
}

std::optional<FrameWorker::Due> FrameWorker::next_due() const {
  std::optional<Due> first;
  if (snapshot_ == nullptr) return first;
  for (const auto& [picture_class, drawn] : drawn_) {
    if (drawn.is_refused || drawn.decode_count == decode_count_) continue;
    const int64_t due_ns = drawn.sequence == 0 ? 0 : drawn.begin_ns + frame_interval_ns_;
    if (!first || due_ns < first->time_ns) first = Due{picture_class, due_ns};
  }
  return first;
}

Status FrameWorker::draw(uint32_t picture_class) {
  Drawn& drawn = drawn_[picture_class];
  drawn.decode_count = decode_count_;
  drawn.begin_ns = now_ns();
  ++drawn.sequence;
  if (painter_ == nullptr) {
    ASSIGN_OR_RETURN(painter_, make_painter_());
  }
  int64_t begin_ns = now_ns();
  ASSIGN_OR_RETURN(const Image image, painter_->paint(snapshot_, drawn.view));
  const double paint_ms = ms_since(begin_ns);
  begin_ns = now_ns();
  ASSIGN_OR_RETURN(const auto jpeg, encode_jpeg(image, drawn.view.jpeg_quality));
  const double jpeg_ms = ms_since(begin_ns);

  FrameHeader header;
  header.opcode = Opcode::JpegFrame;
  header.sequence = drawn.sequence;
  header.sim_time_ns = snapshot_->sim_time_ns;
  header.send_time_ns = now_ns();
  EncodedFramePtr frame = make_encoded_frame(header, jpeg);
  if (frame == nullptr)
    return make_error(ErrorCode::LimitExceeded, "a picture of {} bytes does not fit into one message",
                      jpeg.size());
  {
    const std::lock_guard lock(mutex_);
    ++counters_.frames;
    counters_.bytes += frame->message.size();
    paint_timer_.add_ms(paint_ms);
    jpeg_timer_.add_ms(jpeg_ms);
  }
  hooks_.sink(picture_class, std::move(frame));
  return {};
}

void FrameWorker::refuse(uint32_t picture_class, const Error& error) {
  Drawn& drawn = drawn_[picture_class];
  drawn.is_refused = true;
  log_warn("render", "a view of {} x {} pixels cannot be drawn: {}", drawn.view.size.width,
           drawn.view.size.height, error.to_string());
  if (hooks_.on_refused) hooks_.on_refused(picture_class, error);
}

void FrameWorker::fail(const Error& error) {
  {
    const std::lock_guard lock(mutex_);
    failure_ = error;
  }
  log_error("render", "no frames from now on: {}", error.to_string());
  if (hooks_.on_failure) hooks_.on_failure(error);
}

}  // namespace strandcast
