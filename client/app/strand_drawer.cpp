#include "client/app/strand_drawer.h"

#include <sys/resource.h>
#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "common/base/worker_pool.h"
#include "common/log/log.h"
#include "common/render/render_device.h"

namespace strandcast {
namespace {

/// A software renderer's threads take this over; panels and decoding go first.
constexpr int kDrawingThreadNice = 5;
/// More pictures than a display shows are drawn for nobody.
constexpr int64_t kDrawnAtMostNs = 1'000'000'000 / 60;
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

/// How far two heads have come nearer or farther in a picture, in pixels as seen_motion_px() counts them.
double seen_way_px(const glm::dvec3& way_m, const CameraDesc& camera, RenderSize size) {
  const double distance_m = glm::length(glm::dvec3(camera.offset_m));
  return glm::length(way_m) * 0.5 * size.height / (std::tan(0.5 * camera.fov_y_rad) * distance_m);
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

void StrandDrawer::set_head_count(size_t count) {
  {
    const std::lock_guard lock(mutex_);
    if (count == job_.states.size()) return;
    job_.states.resize(count);
    ++version_;
  }
  changed_.notify_one();
}

void StrandDrawer::set_state(std::shared_ptr<const ViewerState> state, size_t head) {
  {
    const std::lock_guard lock(mutex_);
    if (head >= job_.states.size()) return;
    std::shared_ptr<const ViewerState>& known = job_.states[head];
    // Told every few milliseconds; only what is drawn from is news.
    const bool is_other_look = known == nullptr || known->look.look != state->look.look;
    const bool is_news =
        is_other_look || known->asset != state->asset || known->timeline.newest() != state->timeline.newest();
    known = std::move(state);
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
    heads_.clear();  // while its device is there
  } catch (const std::exception& failure) {
    // Its context went first: what they held of the driver went along.
    for (Head& head : heads_) (void)head.renderer.release();
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
    if (job->view && prepare(device, *job)) turn(*job);
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

/// Whether there are strands that can be drawn, and none that cannot.
bool StrandDrawer::prepare(RenderDevice& device, const Job& job) {
  heads_.resize(job.states.size());
  bool has_any = false;
  for (size_t i = 0; i < job.states.size(); ++i) {
    if (job.states[i] == nullptr || job.states[i]->asset == nullptr) continue;
    if (!prepare(device, job, i)) return false;
    has_any = true;
  }
  return has_any;
}

/// The groom may have changed with the server, the look at any time.
bool StrandDrawer::prepare(RenderDevice& device, const Job& job, size_t index) {
  const ViewerState& state = *job.states[index];
  Head& head = heads_[index];
  if (state.asset == head.asset) {
    if (head.renderer != nullptr) follow_look(head, job.look(index));
    return head.renderer != nullptr;
  }
  head.renderer.reset();
  head.asset = state.asset;
  drawn_.reset();
  head.look = job.look(index);
  auto made = device.make_renderer(*head.asset, head.look);
  if (!made) {
    fail(made.error());
    return false;
  }
  head.renderer = std::move(made).value();
  head.player.set_fill(StrandFill(head.asset->rest_position_m, head.asset->vertex_count));
  is_first_draw_ = true;
  const std::lock_guard lock(mutex_);
  newest_.trouble.reset();
  newest_.look_trouble.reset();
  return true;
}

/// Each is tried once; what cannot be drawn leaves the look of before.
void StrandDrawer::follow_look(Head& head, const LookDesc& look) {
  if (look == head.look) return;
  head.look = look;
  ++look_count_;
  const Status status = head.renderer->set_look(look);
  if (!status) log_warn("render", "the look stays: {}", status.error().to_string());
  const std::lock_guard lock(mutex_);
  newest_.look_trouble = status ? std::nullopt : std::optional(status.error());
}

/// Of the heads of which something has come.
std::vector<StrandDrawer::HeadStrands> StrandDrawer::strands_at(const Job& job, int64_t time_ns) {
  std::vector<HeadStrands> all;
  for (size_t i = 0; i < job.states.size(); ++i) {
    if (job.states[i] == nullptr || heads_[i].renderer == nullptr) continue;
    if (auto strands = heads_[i].player.strands_at(job.states[i]->timeline, time_ns))
      all.push_back({i, std::move(*strands)});
  }
  return all;
}

bool StrandDrawer::has_moved(const Drawn& from, const std::vector<HeadStrands>& to, const DrawView& view) {
  if (from.heads.size() != to.size()) return true;
  for (size_t i = 0; i < to.size(); ++i) {
    const HeadStrands& before = from.heads[i];
    if (before.head != to[i].head ||
        seen_motion_px(before.strands, to[i].strands, view.camera, view.size) > kSeenPx)
      return true;
    // The camera goes along with all heads together, and so with one.
    const auto apart_m = [i](const std::vector<HeadStrands>& heads) {
      return heads[i].strands.world_from_head.position_m - heads[0].strands.world_from_head.position_m;
    };
    if (i > 0 && seen_way_px(apart_m(to) - apart_m(from.heads), view.camera, view.size) > kSeenPx)
      return true;
  }
  return false;
}

void StrandDrawer::turn(const Job& job) {
  const int64_t begin_ns = now_ns();
  std::vector<HeadStrands> strands = strands_at(job, begin_ns);
  if (strands.empty()) return;
  const DrawView& view = *job.view;
  plan_.set_pixels(uint64_t{view.size.width} * view.size.height);
  const bool is_other_view = !drawn_ || !is_same(drawn_->view, view) || drawn_->look_count != look_count_;
  const bool moves = is_other_view || has_moved(*drawn_, strands, view);
  if (moves) plan_.note_motion(begin_ns);
  // Between two states time alone moves the strands.
  const bool is_playing = std::any_of(job.states.begin(), job.states.end(), [](const auto& state) {
    return state != nullptr && state->timeline.playout() == Playout::Smooth && state->is_connected;
  });
  const bool is_asked = !drawn_ || drawn_->asked_whole != job.asked_whole;
  const size_t step =
      is_asked && job.asked_whole > 0 ? 0 : plan_.step_at(begin_ns, drawn_ ? drawn_->step : 0);
  if (moves || is_asked || step < drawn_->step)
    if (const Status status = draw(job, std::move(strands), step); !status) return fail(status.error());
  // Pictures as fast as a display shows them, a sharper one once all stands, or nothing more.
  if (is_playing)
    due_ns_ = begin_ns + kDrawnAtMostNs;
  else if (!drawn_ || drawn_->step > 0)
    due_ns_ = std::max(plan_.standing_from_ns(), begin_ns + kDrawnAtMostNs);
}

Status StrandDrawer::draw(const Job& job, std::vector<HeadStrands> strands, size_t step) {
  const DrawView& view = *job.view;
  const bool is_asked = step == 0 && job.asked_whole > (drawn_ ? drawn_->asked_whole : 0);
  // One that takes longer than what moves may take is left for what the person wants to see instead.
  const auto is_unwanted = [&] {
    return is_stopping_ || (!is_asked && step < plan_.moving_step() && view_number_ != job.view_number);
  };
  const int64_t begin_ns = now_ns();
  std::vector<PlacedHead> heads;
  for (const HeadStrands& one : strands) heads.push_back({heads_[one.head].renderer.get(), &one.strands});
  const HeadsCamera camera{view.camera, job.states[strands.front().head]->look.camera};
  ASSIGN_OR_RETURN(HeadsPicture picture, draw_heads(heads, camera, size_of_step(step, view.size),
                                                    {static_cast<float>(kDrawSteps[step].strand_share),
                                                     is_unwanted, view.debug_view}));
  if (!picture.profile.is_whole) return {};
  auto image = std::make_shared<const Image>(std::move(picture.image));
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
    newest_.sim_time_ns = heads_[drawn_->heads.front().head].player.sim_time_ns();
    newest_.profile = picture.profile;
    newest_.passes = heads.front().renderer->passes().report();
    newest_.renderer_bytes = 0;
    for (const PlacedHead& head : heads) newest_.renderer_bytes += head.renderer->passes().live_bytes();
    newest_.asked_whole = drawn_->asked_whole;
    newest_.fair_ms = plan_.fair_ms(end_ns);
    newest_.interpolation = heads_[drawn_->heads.front().head].player.interpolation();
    if (newest_.interpolation == Interpolation::Linear) ++newest_.linear_count;
    if (newest_.interpolation == Interpolation::Cubic) ++newest_.cubic_count;
    ++newest_.count;
    newest_.draw_timer.add_ms(ms);
  }
  config_.on_news();
  return {};
}

}  // namespace strandcast
