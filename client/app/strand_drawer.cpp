#include "client/app/strand_drawer.h"

#include <sys/resource.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "common/base/worker_pool.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

/// A software renderer's threads take this over; panels and decoding go first.
constexpr int kDrawingThreadNice = 5;
/// More pictures than a display shows are drawn for nobody.
constexpr int64_t kDisplayNs = 1'000'000'000 / 60;
/// Where to begin: what a processor draws in time on most machines, and what a GPU does.
constexpr size_t kFirstSoftwareStep = 3;
constexpr size_t kFirstHardwareStep = 0;

bool is_same(const DrawView& a, const DrawView& b) {
  return a.camera.offset_m == b.camera.offset_m && a.camera.target_m == b.camera.target_m &&
         a.camera.fov_y_rad == b.camera.fov_y_rad && a.debug_view == b.debug_view &&
         a.size.width == b.size.width && a.size.height == b.size.height;
}

/// No larger than a picture may be, of the same shape.
DrawView limited(DrawView view) {
  const uint32_t longest = std::max(view.size.width, view.size.height);
  if (longest <= kMaxImageSide) return view;
  const double scale = static_cast<double>(kMaxImageSide) / longest;
  view.size.width = std::max(static_cast<uint32_t>(view.size.width * scale), 1u);
  view.size.height = std::max(static_cast<uint32_t>(view.size.height * scale), 1u);
  return view;
}

}  // namespace

StrandDrawer::StrandDrawer(Config config) : config_(std::move(config)) {
  shared_workers();  // no nicer than this thread, as the one that draws is
  thread_ = std::thread([this] { run(); });
}

StrandDrawer::~StrandDrawer() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void StrandDrawer::set_state(std::shared_ptr<const ViewerState> state) {
  {
    const std::lock_guard lock(mutex_);
    // Told every few milliseconds; only what is drawn from is news.
    const bool is_other_look = job_.state == nullptr || job_.state->look.look != state->look.look;
    const bool is_news = is_other_look || job_.state->asset != state->asset ||
                         job_.state->timeline.newest() != state->timeline.newest();
    job_.state = std::move(state);
    if (is_other_look) job_.view_number = ++view_number_;
    if (!is_news) return;
    ++version_;
  }
  changed_.notify_one();
}

void StrandDrawer::set_view(const std::optional<DrawView>& view) {
  {
    const std::lock_guard lock(mutex_);
    const std::optional<DrawView> wanted = view ? std::optional(limited(*view)) : std::nullopt;
    const bool is_news =
        wanted.has_value() != job_.view.has_value() || (wanted && !is_same(*wanted, *job_.view));
    if (!is_news) return;
    job_.view = wanted;
    job_.view_number = ++view_number_;
    ++version_;
  }
  changed_.notify_one();
}

void StrandDrawer::set_own_look(const std::optional<LookDesc>& look) {
  {
    const std::lock_guard lock(mutex_);
    if (look == job_.own_look) return;
    job_.own_look = look;
    job_.view_number = ++view_number_;
    ++version_;
  }
  changed_.notify_one();
}

uint64_t StrandDrawer::ask_whole() {
  uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = ++job_.asked_whole;
    ++version_;
  }
  changed_.notify_one();
  return number;
}

DrawnState StrandDrawer::look() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void StrandDrawer::run() {
  try {
    setpriority(PRIO_PROCESS, 0, kDrawingThreadNice);
    auto device = RenderDevice::open(config_.device);
    {
      const std::lock_guard lock(mutex_);
      if (device)
        newest_.device = (*device)->info();
      else
        newest_.device = device.error();
    }
    if (device) log_info("render", "strands are drawn by {}", (*device)->info().name);
    config_.on_news();
    if (device) draw_until_stopped(**device);
    renderer_.reset();  // while its device is there
  } catch (const std::exception& failure) {
    (void)renderer_.release();  // its context went first: what it held of the driver went along
    fail(make_error(ErrorCode::Internal, "the drawing thread failed: {}", failure.what()));
  }
}

void StrandDrawer::fail(const Error& error) {
  log_error("render", "{}", error.to_string());
  {
    const std::lock_guard lock(mutex_);
    newest_.trouble = error;
  }
  config_.on_news();
}

void StrandDrawer::draw_until_stopped(RenderDevice& device) {
  plan_ = DrawPlan(device.info().is_software ? kFirstSoftwareStep : kFirstHardwareStep);
  while (const auto job = wait_for_job())
    if (job->view && job->state != nullptr && prepare(device, *job)) turn(*job);
}

/// What is to be drawn; nothing at the end.
std::optional<StrandDrawer::Job> StrandDrawer::wait_for_job() {
  std::unique_lock lock(mutex_);
  const auto is_due = [&] { return is_stopping_ || version_ != done_version_; };
  if (due_ns_) {
    const auto wait = std::chrono::nanoseconds(std::max<int64_t>(*due_ns_ - now_ns(), 0));
    changed_.wait_for(lock, wait, is_due);
  } else {
    changed_.wait(lock, is_due);
  }
  if (is_stopping_) return std::nullopt;
  due_ns_.reset();
  done_version_ = version_;
  return job_;
}

/// Whether the newest strands can be drawn. The groom may have changed with the server, the look at any time.
bool StrandDrawer::prepare(RenderDevice& device, const Job& job) {
  const ViewerState& state = *job.state;
  if (state.asset == nullptr) return false;
  if (state.asset == asset_) {
    if (renderer_ != nullptr) follow_look(job.look());
    return renderer_ != nullptr;
  }
  renderer_.reset();
  asset_ = state.asset;
  drawn_.reset();
  look_ = job.look();
  auto made = device.make_renderer(*asset_, look_);
  if (!made) {
    fail(made.error());
    return false;
  }
  renderer_ = std::move(made).value();
  player_.set_fill(StrandFill(asset_->rest_position_m, asset_->vertex_count));
  is_first_draw_ = true;
  const std::lock_guard lock(mutex_);
  newest_.trouble.reset();
  newest_.look_trouble.reset();
  return true;
}

/// Each is tried once; what cannot be drawn leaves the look of before.
void StrandDrawer::follow_look(const LookDesc& look) {
  if (look == look_) return;
  look_ = look;
  ++look_count_;
  const Status status = renderer_->set_look(look);
  if (!status) log_warn("render", "the look stays: {}", status.error().to_string());
  const std::lock_guard lock(mutex_);
  newest_.look_trouble = status ? std::nullopt : std::optional(status.error());
}

void StrandDrawer::turn(const Job& job) {
  const int64_t begin_ns = now_ns();
  auto strands = player_.strands_at(job.state->timeline, begin_ns);
  if (!strands) return;
  const DrawView& view = *job.view;
  plan_.set_pixels(uint64_t{view.size.width} * view.size.height);
  const bool is_other_view = !drawn_ || !is_same(drawn_->view, view) || drawn_->look_count != look_count_;
  const bool has_moved =
      is_other_view || seen_motion_px(drawn_->strands, *strands, view.camera, view.size) > kSeenPx;
  if (has_moved) plan_.note_motion(begin_ns);
  // Between two states time alone moves the strands.
  const bool is_playing = job.state->timeline.playout() == Playout::Smooth && job.state->is_connected;
  const bool is_asked = !drawn_ || drawn_->asked_whole != job.asked_whole;
  const size_t step =
      is_asked && job.asked_whole > 0 ? 0 : plan_.step_at(begin_ns, drawn_ ? drawn_->step : 0);
  if (has_moved || is_asked || step < drawn_->step)
    if (const Status status = draw(job, std::move(*strands), step); !status) return fail(status.error());
  // Pictures as fast as a display shows them, a sharper one once all stands, or nothing more.
  if (is_playing)
    due_ns_ = begin_ns + kDisplayNs;
  else if (!drawn_ || drawn_->step > 0)
    due_ns_ = std::max(plan_.standing_from_ns(), begin_ns + kDisplayNs);
}

Status StrandDrawer::draw(const Job& job, PosedStrands strands, size_t step) {
  const DrawView& view = *job.view;
  const bool is_asked = step == 0 && job.asked_whole > (drawn_ ? drawn_->asked_whole : 0);
  // One that takes longer than what moves may take is left for what the person wants to see instead.
  const auto is_unwanted = [&] {
    return is_stopping_ || (!is_asked && step < plan_.moving_step() && view_number_ != job.view_number);
  };
  const int64_t begin_ns = now_ns();
  RETURN_IF_ERROR(
      renderer_->draw(strands, view.camera, size_of_step(step, view.size),
                      {static_cast<float>(kDrawSteps[step].strand_share), is_unwanted, view.debug_view}));
  if (!renderer_->profile().is_whole) return {};
  auto image = std::make_shared<const Image>(renderer_->read_image());
  const int64_t end_ns = now_ns();
  const double ms = static_cast<double>(end_ns - begin_ns) * 1e-6;
  const bool is_measured = !std::exchange(is_first_draw_, false);
  if (is_measured) plan_.note_drawn(step, ms, end_ns);
  drawn_ = Drawn{std::move(strands), view, step,
                 step == 0 ? job.asked_whole
                 : drawn_  ? drawn_->asked_whole
                           : 0,
                 look_count_};
  {
    const std::lock_guard lock(mutex_);
    newest_.image = std::move(image);
    newest_.step = step;
    newest_.sim_time_ns = player_.sim_time_ns();
    newest_.profile = renderer_->profile();
    newest_.passes = renderer_->passes().report();
    newest_.renderer_bytes = renderer_->passes().live_bytes();
    newest_.asked_whole = drawn_->asked_whole;
    newest_.fair_ms = plan_.fair_ms(end_ns);
    newest_.interpolation = player_.interpolation();
    if (newest_.interpolation == Interpolation::Linear) ++newest_.linear_count;
    if (newest_.interpolation == Interpolation::Cubic) ++newest_.cubic_count;
    ++newest_.count;
    newest_.draw_timer.add_ms(ms);
  }
  config_.on_news();
  return {};
}

}  // namespace strandcast
