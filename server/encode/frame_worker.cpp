#include "server/encode/frame_worker.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/base/thread_name.h"
#include "common/base/units.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

// Strand frames that may wait while a picture is drawn; beyond it a keyframe is cheaper than catching up.
constexpr size_t kMaxPendingFrames = 256;
constexpr size_t kMaxPendingBytes = 64u << 20;
constexpr int kFrameThreadNice = 10;
/// Weight of the newest drawing in what a view costs: a first drawing also pays for buffers and shaders.
constexpr double kNewestCostShare = 0.5;

/// Weight of the newest state in how long states take to come, which is never thought to be more than this.
constexpr double kNewestLeadShare = 0.25;
constexpr double kMostLeadMs = 100.0;

/// Whether other views can still be drawn: this one is too large, say, or its camera impossible.
bool concerns_view_only(const Error& error) {
  return error.code == ErrorCode::BadInput || error.code == ErrorCode::LimitExceeded;
}

double drawn_pixels_of(const PictureView& view) {
  return static_cast<double>(view.size.width) * static_cast<double>(view.size.height);
}

double ms_since(int64_t begin_ns) {
  return static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
}

}  // namespace

FrameWorker::FrameWorker(std::unique_ptr<StrandDecoder> decoder, MakePicturePainter make_painter,
                         FrameWorkerConfig config, Hooks hooks)
    : decoder_(std::move(decoder)),
      make_painter_(std::move(make_painter)),
      config_(config),
      frame_interval_ns_(static_cast<int64_t>(kNsPerS / config.rate_hz)),
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

void FrameWorker::set_views(std::map<uint32_t, PictureView> views, int64_t painter_rest_ns) {
  {
    const std::lock_guard lock(mutex_);
    views_ = std::move(views);
    painter_rest_ns_ = painter_rest_ns;
    has_new_views_ = true;
    if (views_.empty()) {
      has_gap_ = true;
      pending_.clear();
      pending_bytes_ = 0;
    }
  }
  changed_.notify_all();
}

void FrameWorker::set_look(const LookDesc& look) {
  {
    const std::lock_guard lock(mutex_);
    new_look_ = look;
  }
  changed_.notify_all();
}

void FrameWorker::request_whole(uint32_t picture_class) {
  {
    const std::lock_guard lock(mutex_);
    if (!can_draw() || !views_.contains(picture_class)) return;
    wanted_wholes_.insert(picture_class);
  }
  changed_.notify_all();
}

void FrameWorker::redraw() {
  {
    const std::lock_guard lock(mutex_);
    if (!can_draw()) return;
    is_redraw_wanted_ = true;
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
  counters.encode_median_ms = encode_timer_.median_ms();
  return counters;
}

std::vector<PictureMotion> FrameWorker::take_motions() {
  const std::lock_guard lock(mutex_);
  const auto taken = std::exchange(motions_, {});
  return {taken.begin(), taken.end()};
}

gl::PassReports FrameWorker::passes() const {
  const std::lock_guard lock(mutex_);
  if (painted_.empty()) return {};
  PictureCodecs wanted = 0;
  for (const auto& [picture_class, view] : views_) wanted |= codec_bit(view.codec);
  return picture_passes(timers_, painted_, wanted);
}

void FrameWorker::run() {
  name_thread("frames");
  // Drawing in software takes every core it gets; the simulation goes first. On Linux this is the thread's
  // own value, and the driver's threads inherit it.
  setpriority(PRIO_PROCESS, 0, kFrameThreadNice);
  while (true) {
    const Job job = wait_for_job();
    if (job.is_stopping) break;
    if (job.look) take_look(*job.look);
    if (job.views.empty()) {
      rest(job.painter_rest_ns);
      continue;
    }
    // Who looks away and back within a drawing was never seen to be gone.
    if (!is_active_ || job.has_gap) begin();
    update_views(job.views);
    decode(job.strand_frames);
    if (job.is_redrawn) ++decode_count_;
    for (const uint32_t picture_class : job.wholes)
      if (const auto drawn = drawn_.find(picture_class); drawn != drawn_.end())
        drawn->second.is_whole_wanted = drawn->second.encoder != nullptr;
    const auto due = next_due();
    if (due && due->wait.due_ns <= now_ns()) serve(*due);
  }
  painter_.reset();  // on the thread that owns its context
}

FrameWorker::Job FrameWorker::wait_for_job() {
  std::unique_lock lock(mutex_);
  while (true) {
    const bool has_news = is_stopping_ || can_draw() != is_active_ || has_new_views_ || !pending_.empty() ||
                          !wanted_wholes_.empty() || new_look_ || is_redraw_wanted_;
    const auto due = is_active_ ? next_due() : std::nullopt;
    std::optional<int64_t> due_ns;
    if (due) due_ns = due->wait.due_ns;
    if (!is_active_ && painter_ != nullptr) due_ns = resting_since_ns_ + painter_rest_ns_;
    const int64_t wait_ns = due_ns ? *due_ns - now_ns() : 1;
    if (has_news || wait_ns <= 0) break;
    if (due_ns)
      changed_.wait_for(lock, std::chrono::nanoseconds(wait_ns));
    else
      changed_.wait(lock);
  }
  has_new_views_ = false;
  pending_bytes_ = 0;
  Job job{std::exchange(pending_, {}),
          {},
          painter_rest_ns_,
          std::exchange(has_gap_, false),
          std::exchange(wanted_wholes_, {}),
          std::exchange(new_look_, std::nullopt),
          std::exchange(is_redraw_wanted_, false),
          is_stopping_};
  if (can_draw()) job.views = views_;
  return job;
}

void FrameWorker::begin() {
  is_active_ = true;
  is_chain_lost_ = true;
  hooks_.request_keyframe();
}

void FrameWorker::rest(int64_t painter_rest_ns) {
  if (std::exchange(is_active_, false)) resting_since_ns_ = now_ns();
  if (failure() || now_ns() - resting_since_ns_ >= painter_rest_ns) painter_.reset();
  snapshot_.reset();
  drawn_.clear();
  const std::lock_guard lock(mutex_);
  painted_.clear();
}

/// The same state is drawn again, as with another camera.
void FrameWorker::take_look(LookDesc look) {
  wanted_look_ = std::move(look);
  for (auto& [picture_class, drawn] : drawn_) {
    drawn.decode_count = 0;
    drawn.is_refused = false;
    drawn.is_still = false;
  }
}

void FrameWorker::update_views(const std::map<uint32_t, PictureView>& views) {
  std::erase_if(drawn_, [&](const auto& entry) { return !views.contains(entry.first); });
  for (const auto& [picture_class, view] : views) {
    Drawn& drawn = drawn_[picture_class];
    if (!(drawn.view == view)) {  // another camera: draw the same state again
      drawn.decode_count = 0;
      drawn.is_refused = false;
      drawn.is_still = false;
    }
    const bool is_other_stream = drawn.view.codec != view.codec || drawn.view.size.width != view.size.width ||
                                 drawn.view.size.height != view.size.height ||
                                 (is_video(view.codec) && drawn.view.rate_divisor != view.rate_divisor);
    if (drawn.encoder != nullptr && is_other_stream) {
      drawn.last_sequence = drawn.encoder->sequence();
      drawn.encoder.reset();
      drawn.is_whole_wanted = false;
    }
    if (drawn_pixels_of(drawn.view) != drawn_pixels_of(view)) drawn.cost_ms = 0.0;
    drawn.view = view;
  }
  share_time();
}

/// Settles how often each view may be drawn. Classes that look alike are one drawing.
void FrameWorker::share_time() {
  const double interval_ms = static_cast<double>(frame_interval_ns_) * kMsPerNs;
  std::vector<std::vector<Drawn*>> alike;
  std::vector<PictureLoad> loads;
  for (auto& [picture_class, drawn] : drawn_) {
    if (drawn.is_refused) continue;
    size_t i = 0;
    while (i < alike.size() && !look_alike(alike[i].front()->view, drawn.view)) ++i;
    if (i == alike.size()) {
      alike.emplace_back();
      loads.push_back({0.0, drawn.view.rate_divisor * interval_ms});
    }
    alike[i].push_back(&drawn);
    const double guess_ms = ms_per_pixel_ * drawn_pixels_of(drawn.view);
    loads[i].cost_ms = std::max(loads[i].cost_ms, drawn.cost_ms > 0.0 ? drawn.cost_ms : guess_ms);
    loads[i].period_ms = std::min(loads[i].period_ms, drawn.view.rate_divisor * interval_ms);
  }
  const std::vector<PictureTurn> turns = share_drawing_time(loads);
  for (size_t i = 0; i < alike.size(); ++i)
    for (Drawn* drawn : alike[i]) {
      const auto spacing_ns = static_cast<int64_t>(turns[i].spacing_ms / kMsPerNs);
      drawn->spacing_ns = std::max(spacing_ns, period_ns(*drawn));
      drawn->is_blocking = turns[i].is_blocking;
    }
}

void FrameWorker::note_cost(const std::vector<uint32_t>& classes, double cost_ms) {
  for (const uint32_t picture_class : classes) {
    Drawn& drawn = drawn_[picture_class];
    ms_per_pixel_ = cost_ms / drawn_pixels_of(drawn.view);
    drawn.cost_ms = drawn.cost_ms == 0.0
                        ? cost_ms
                        : kNewestCostShare * cost_ms + (1.0 - kNewestCostShare) * drawn.cost_ms;
  }
  share_time();
  if (!classes.empty() && drawn_[classes.front()].is_blocking)
    blocking_rest_ns_ = now_ns() + static_cast<int64_t>(blocking_rest_ms(cost_ms) / kMsPerNs);
}

void FrameWorker::decode(const std::deque<EncodedFramePtr>& strand_frames) {
  uint64_t decoded = 0, losses = 0;
  std::vector<double> decode_ms;
  for (const EncodedFramePtr& frame : strand_frames) {
    if (is_chain_lost_ && frame->header.opcode != Opcode::StrandKeyframe) continue;
    const int64_t begin_ns = now_ns();
    auto snapshot = decoder_->decode(frame->message);
    decode_ms.push_back(ms_since(begin_ns));
    note_arrival(*frame, decode_ms.back());
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
  for (const double one_ms : decode_ms) timers_.decode.add_ms(one_ms);
  counters_.decoded += decoded;
  counters_.chain_losses += losses;
}

/// Asks for the state of the next drawing, which can begin when the thread is free at `free_ns`: so early
/// that it is there then, and no earlier, so that it is not old.
void FrameWorker::request_state(int64_t free_ns) {
  std::optional<int64_t> due_ns;
  for (const auto& [picture_class, drawn] : drawn_)
    if (!drawn.is_refused) due_ns = std::min(due_ns.value_or(paint_due_ns(drawn)), paint_due_ns(drawn));
  if (!due_ns || !hooks_.request_state) return;
  const int64_t wanted_ns = std::max(*due_ns, free_ns) - static_cast<int64_t>(lead_ms_ / kMsPerNs);
  asked_ns_ = std::max(wanted_ns, now_ns());
  hooks_.request_state(wanted_ns);
}

void FrameWorker::note_arrival(const EncodedFrame& frame, double decode_ms) {
  const int64_t way_ns = frame.header.send_time_ns - std::exchange(asked_ns_, 0);
  if (way_ns < 0 || way_ns == frame.header.send_time_ns) return;  // it was on its way, or nobody had asked
  const double taken_ms = std::min(static_cast<double>(way_ns) * kMsPerNs + decode_ms, kMostLeadMs);
  lead_ms_ += kNewestLeadShare * (taken_ms - lead_ms_);
}

std::optional<FrameWorker::Due> FrameWorker::next_due() const {
  std::optional<Due> first;
  if (snapshot_ == nullptr) return first;
  const int64_t time_ns = now_ns();
  for (const auto& [picture_class, drawn] : drawn_) {
    const auto due = next_due_of(picture_class, drawn);
    if (due && (!first || goes_before(due->wait, first->wait, time_ns))) first = due;
  }
  return first;
}

std::optional<FrameWorker::Due> FrameWorker::next_due_of(uint32_t picture_class, const Drawn& drawn) const {
  std::optional<Due> first;
  if (drawn.is_refused) return first;
  const auto consider = [&](Task task, int64_t time_ns) {
    if (!first || time_ns < first->wait.due_ns)
      first = Due{picture_class, task, {time_ns, time_ns + drawn.spacing_ns}};
  };
  const bool is_current = drawn.decode_count == decode_count_;
  if (!is_current) consider(Task::Paint, paint_due_ns(drawn));
  if (drawn.encoder == nullptr) return first;
  if (drawn.is_whole_wanted) consider(Task::Whole, drawn.encoder->whole_due_ns());
  if (config_.still_periods > 0 && !drawn.is_still && is_current)
    consider(Task::Still, drawn.change_ns + config_.still_periods * frame_interval_ns_);
  return first;
}

int64_t FrameWorker::paint_due_ns(const Drawn& drawn) const {
  const int64_t due_ns = drawn.schedule.due_ns(drawn.spacing_ns, period_ns(drawn));
  return drawn.is_blocking ? std::max(due_ns, blocking_rest_ns_) : due_ns;
}

void FrameWorker::serve(const Due& due) {
  if (due.task == Task::Paint) return paint_alike(drawn_[due.picture_class].view);
  if (const Status done = resend(due); !done) refuse(due.picture_class, done.error());
}

/// Draws once for all classes that show this and whose turn has come, or almost.
void FrameWorker::paint_alike(const PictureView& view) {
  const int64_t begin_ns = now_ns();
  std::vector<uint32_t> classes;
  for (auto& [picture_class, drawn] : drawn_) {
    const bool is_due = !drawn.is_refused && drawn.decode_count != decode_count_ &&
                        paint_due_ns(drawn) <= begin_ns + frame_interval_ns_ / 2;
    if (!is_due || !look_alike(drawn.view, view)) continue;
    drawn.decode_count = decode_count_;
    drawn.sim_time_ns = snapshot_->sim_time_ns;
    drawn.schedule.begin(begin_ns, drawn.spacing_ns);
    classes.push_back(picture_class);
  }
  if (!classes.empty())
    request_state(begin_ns + static_cast<int64_t>(drawn_[classes.front()].cost_ms / kMsPerNs));
  note_motion();
  const bool had_painter = painter_ != nullptr;
  const Result<Image> image = paint(view);
  {
    const std::lock_guard lock(mutex_);
    ++counters_.paints;
    paint_timer_.add_ms(ms_since(begin_ns));
    if (painter_ != nullptr) painted_ = painter_->passes();
  }
  if (image) note_left_out();
  for (const uint32_t picture_class : classes) {
    if (image) {
      if (const Status encoded = encode(picture_class, *image); !encoded)
        refuse(picture_class, encoded.error());
    } else if (concerns_view_only(image.error())) {
      refuse(picture_class, image.error());
    } else if (!failure()) {
      fail(image.error());
    }
  }
  // Making the painter compiles shaders, which is no cost of this view.
  if (image && had_painter) note_cost(classes, ms_since(begin_ns));
}

Result<Image> FrameWorker::paint(const PictureView& view) {
  if (painter_ == nullptr) {
    ASSIGN_OR_RETURN(painter_, make_painter_());
    if (look_) RETURN_IF_ERROR(painter_->set_look(*look_));  // which was drawn before
  }
  follow_look();
  return painter_->paint(snapshot_, view);
}

/// Told once: a scene that is too large is so in every picture.
void FrameWorker::note_left_out() {
  const RenderProfile profile = painter_->profile();
  {
    const std::lock_guard lock(mutex_);
    counters_.left_out_strands = profile.left_out_strands;
    counters_.unusable_segments = profile.unusable_segments;
  }
  const std::string text = left_out_text(profile);
  if (text.empty() || std::exchange(was_left_out_, true)) return;
  log_warn("render", "pictures lack {} ({} strands are drawn)", text, profile.drawn_strands);
}

/// The same sample in later states is not late, it is held.
void FrameWorker::note_motion() {
  if (snapshot_->motion_time_ns == std::exchange(motion_time_ns_, snapshot_->motion_time_ns)) return;
  if (motion_time_ns_ == 0) return;
  const std::lock_guard lock(mutex_);
  motions_.push_back({snapshot_->sim_time_ns, motion_time_ns_});
  if (motions_.size() > kMaxPictureMotions) motions_.pop_front();
}

/// Where the look that is wanted cannot be drawn, pictures go on with the one before.
void FrameWorker::follow_look() {
  if (!wanted_look_) return;
  const LookDesc wanted = *std::exchange(wanted_look_, std::nullopt);
  const Status status = painter_->set_look(wanted);
  if (status) {
    look_ = wanted;
    return;
  }
  log_warn("render", "pictures keep their look: {}", status.error().to_string());
  if (!hooks_.on_look_refused) return;
  for (const auto& [picture_class, drawn] : drawn_) hooks_.on_look_refused(picture_class, status.error());
}

PictureStamp FrameWorker::stamp(uint32_t picture_class, bool is_still) const {
  return {picture_stream_id(picture_class), drawn_.at(picture_class).sim_time_ns, now_ns(), is_still};
}

Status FrameWorker::encode(uint32_t picture_class, const Image& image) {
  Drawn& drawn = drawn_[picture_class];
  if (drawn.encoder == nullptr) {
    const double rate_hz = config_.rate_hz / drawn.view.rate_divisor;
    ASSIGN_OR_RETURN(drawn.encoder, make_picture_encoder(drawn.view, rate_hz, drawn.last_sequence));
  }
  const int64_t begin_ns = now_ns();
  ASSIGN_OR_RETURN(const PicturePtr picture,
                   drawn.encoder->encode(image, drawn.view.quality, stamp(picture_class, false)));
  if (picture == nullptr) {
    const std::lock_guard lock(mutex_);
    ++counters_.unchanged;
    return {};
  }
  drawn.change_ns = now_ns();
  drawn.is_still = false;
  if (picture->can_follow(0)) drawn.is_whole_wanted = false;
  {
    const std::lock_guard lock(mutex_);
    encode_timer_.add_ms(ms_since(begin_ns));
    timers_.encode[static_cast<size_t>(drawn.view.codec)].add_ms(ms_since(begin_ns));
  }
  give(picture_class, picture);
  return {};
}

/// Sends the shown picture once more: whole, or finely.
Status FrameWorker::resend(const Due& due) {
  Drawn& drawn = drawn_[due.picture_class];
  const bool is_still = due.task == Task::Still;
  (is_still ? drawn.is_still : drawn.is_whole_wanted) = is_still;
  PictureEncoder& encoder = *drawn.encoder;
  const uint32_t last_sequence = encoder.sequence();
  const PictureStamp now = stamp(due.picture_class, is_still);
  ASSIGN_OR_RETURN(const PicturePtr picture, is_still ? encoder.still(now) : encoder.whole(now));
  if (picture == nullptr) return {};
  {
    const std::lock_guard lock(mutex_);
    ++(is_still ? counters_.stills : counters_.wholes);
  }
  if (encoder.sequence() != last_sequence) {
    give(due.picture_class, picture);
    // A video keyframe is coarse again.
    if (!is_still) drawn.is_still = false;
  } else {
    hooks_.sink(due.picture_class, picture);
  }
  return {};
}

void FrameWorker::give(uint32_t picture_class, const PicturePtr& picture) {
  {
    const std::lock_guard lock(mutex_);
    ++counters_.frames;
    counters_.bytes += picture->message_bytes();
  }
  hooks_.sink(picture_class, picture);
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
  log_error("render", "no pictures from now on: {}", error.to_string());
  if (hooks_.on_failure) hooks_.on_failure(error);
}

}  // namespace strandcast
