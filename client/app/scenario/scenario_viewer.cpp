#include "client/app/scenario/scenario_viewer.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <tuple>
#include <utility>

#include "client/app/view_options.h"
#include "common/base/check.h"
#include "common/base/thread_name.h"
#include "common/base/units.h"
#include "common/kernels/step_speed.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kScenarioPumpWait{5};
constexpr int64_t kReportNs = 1'000'000'000;
constexpr double kBytesPerMbit = 125e3;
constexpr int64_t kMomentNs = 100'000'000;  // between two of coherence, as strandcast-report takes them

chaos::LinkPlan plan_of(double loss, double delay_ms) {
  chaos::LinkPlan plan;
  plan.loss = loss;
  plan.delay_us = static_cast<int64_t>(delay_ms * kUsPerMs);
  return plan;
}

Result<std::unique_ptr<chaos::ChaosRelay>> make_link(const ScenarioView& view, const Address& server,
                                                     ViewerTask task) {
  if (!task.has_changing_link && view.link_mbit <= 0.0 && view.delay_ms <= 0.0)
    return std::unique_ptr<chaos::ChaosRelay>();
  chaos::RelayConfig config;
  config.to_host = server.host;
  config.to_port = server.port;
  config.up = config.down = plan_of(0.0, view.delay_ms);
  config.down.bytes_per_s = static_cast<uint64_t>(view.link_mbit * kBytesPerMbit);
  return chaos::ChaosRelay::start(config);
}

DrawingDevice device_of(const std::string& draws) {
  if (draws == "none") return DrawingDevice::None;
  if (draws == "software") return DrawingDevice::Software;
  return draws == "hardware" ? DrawingDevice::Hardware : DrawingDevice::Unknown;
}

}  // namespace

Result<std::unique_ptr<ScenarioViewer>> ScenarioViewer::join(const ScenarioView& view, ClientConfig config,
                                                             ViewerTask task) {
  ASSIGN_OR_RETURN(auto relay, make_link(view, config.address, task));
  if (relay != nullptr) config.address = {"127.0.0.1", relay->port(), config.address.is_tls};
  ASSIGN_OR_RETURN(config.hello.mode, parse_mode(view.mode));
  config.hello.name = "scenario " + view.name;
  config.hello.frame_width = view.width;
  config.hello.frame_height = view.height;
  config.hello.codec_wish = view.codec;
  config.hello.step_ns = measured_step_ns();
  std::unique_ptr<ScenarioViewer> viewer(new ScenarioViewer(view, task, std::move(relay)));
  auto joined = std::make_shared<std::promise<Status>>();
  viewer->thread_ = std::thread([self = viewer.get(), config = std::move(config), joined] {
    name_thread("viewer");
    auto live = LiveConnection::open(config);
    joined->set_value(live ? Status() : Status(live.error()));
    if (live) self->run(**live);
  });
  const Status status = joined->get_future().get();
  if (!status) return status.error();
  return viewer;
}

ScenarioViewer::~ScenarioViewer() {
  is_leaving_ = true;
  if (thread_.joinable()) thread_.join();
}

void ScenarioViewer::run(LiveConnection& live) {
  watch(live.session());
  int64_t reported_ns = 0;
  while (!is_leaving_) {
    const ViewerCounts before = counts_of(live.session());
    if (live.pump(kScenarioPumpWait)) {
      earlier_ = before;
      watch(live.session());
    }
    note(live);
    if (!live.is_connected() || now_ns() - reported_ns < kReportNs) continue;
    reported_ns = now_ns();
    ViewerReport report;
    report.decode_ms = std::min(live.session().replay().decode_timer().median_ms(), kMaxReportedMs);
    report.picture_decode_ms = std::min(live.session().picture_decode_timer().median_ms(), kMaxReportedMs);
    report.wrong_states = static_cast<uint32_t>(live.session().replay().stats().wrong_states);
    report.draw_ms = view_.draw_ms;
    report.device = device_of(view_.draws);
    // One that is lost is followed by the next.
    (void)live.session().client().send(report);
  }
  live.session().set_snapshot_listener({});
}

void ScenarioViewer::watch(ViewerSession& session) {
  measured_asset_.reset();
  last_sim_time_ns_ = 0;
  last_state_ = nullptr;
  {
    const std::lock_guard lock(mutex_);
    next_moment_ns_ = 0;
  }
  session.set_snapshot_listener([this, &session](const auto& state) { take(session, state); });
}

/// Returns the counts of all sessions so far.
ViewerCounts ScenarioViewer::counts_of(ViewerSession& session) const {
  const ReplayStats& strands = session.replay().stats();
  ViewerCounts counts = earlier_;
  counts.frames += session.decoded_frames();
  counts.strand_frames += strands.decoded_frames;
  counts.strand_bytes += strands.received_bytes;
  counts.received_bytes += session.client().counters().received_bytes;
  counts.rejected_frames += strands.rejected_frames + session.picture_stats().rejected_frames;
  return counts;
}

void ScenarioViewer::note(LiveConnection& live) {
  ViewerSession& session = live.session();
  const ViewerCounts counts = counts_of(session);
  const std::string trouble = live.trouble();
  const std::lock_guard lock(mutex_);
  look_.counts = counts;
  look_.is_connected = live.is_connected();
  note_return();
  look_.trouble = trouble;
  look_.mode = session.mode();
  look_.mode_reason = session.mode_reason();
  look_.rate_divisor = session.quality().rate_divisor;
  look_.codec = session.welcome().codec;
  const int64_t seen_ns = picture_.image == session.shared_image() ? picture_.image_seen_ns : now_ns();
  picture_ = {session.shared_asset(),
              session.replay().newest(),
              session.shared_image(),
              session.look(),
              session.mode(),
              session.image_sim_time_ns(),
              seen_ns,
              session.is_image_still()};
}

/// Whoever is lost again is away again. mutex_ is held.
void ScenarioViewer::note_return() {
  if (!look_.is_connected) {
    frames_before_ = look_.counts.frames;
    look_.back_ns = 0;
    awaits_loss_ = false;
  } else if (!awaits_loss_ && look_.back_ns == 0 && look_.counts.frames > frames_before_) {
    look_.back_ns = now_ns();
  }
}

void ScenarioViewer::measure_rest(const std::shared_ptr<const SceneAsset>& asset) {
  if (asset == measured_asset_ || asset == nullptr) return;
  measured_asset_ = asset;
  rest_length_m_.clear();
  const size_t strands = asset->strand_count;
  for (size_t i = 0; i + strands < asset->rest_position_m.size(); ++i)
    rest_length_m_.push_back(glm::distance(asset->rest_position_m[i], asset->rest_position_m[i + strands]));
}

/// Since the state before; 0 for the first of a server.
double ScenarioViewer::head_mps(const Snapshot& state) {
  const int64_t passed_ns = state.sim_time_ns - last_sim_time_ns_;
  const bool has_last = std::exchange(last_sim_time_ns_, state.sim_time_ns) != 0 && passed_ns > 0;
  const Pose before = std::exchange(last_world_from_head_, state.world_from_head);
  if (!has_last) return 0.0;
  const double mps = glm::distance(before.position_m, state.world_from_head.position_m) /
                     (static_cast<double>(passed_ns) * 1e-9);
  return is_finite(state.world_from_head) ? mps : std::numeric_limits<double>::infinity();
}

void ScenarioViewer::take(ViewerSession& session, const std::shared_ptr<const Snapshot>& state) {
  measure_rest(session.shared_asset());
  double stretch = 0.0, grain = 0.0;
  StretchPlace place;
  const std::vector<glm::vec3> position_m = positions_in_head(*state);
  const size_t sent = state->strand_count;
  const double bound_m = static_cast<double>(session.quality().bound_m);
  for (uint32_t vertex = 0; measured_asset_ != nullptr && vertex + 1 < state->vertex_count; ++vertex) {
    for (size_t strand = 0; strand < sent; ++strand) {
      const double rest_m =
          static_cast<double>(rest_length_m_[vertex * measured_asset_->strand_count + strand]);
      if (rest_m <= 0.0) continue;
      const size_t i = vertex * sent + strand;
      const double length_m = static_cast<double>(glm::distance(position_m[i], position_m[i + sent]));
      if (const double more = length_m / rest_m - 1.0; more > stretch) {
        stretch = more;
        place.strand = strand;
        place.vertex = vertex;
      }
      grain = std::max(grain, 2.0 * bound_m / rest_m);
    }
  }
  const double mps = head_mps(*state);
  measure_moment(state);
  const std::lock_guard lock(mutex_);
  look_.largest_head_mps = std::max(look_.largest_head_mps, mps);
  look_.tick = state->tick;
  look_.vertices = state->strand_count * state->vertex_count;
  if (stretch > look_.largest_stretch) {
    look_.largest_stretch = stretch;
    look_.stretch_place = place;
    look_.stretch_place.time_s = static_cast<double>(state->sim_time_ns) * kSPerNs;
    look_.stretch_place.tick = state->tick;
  }
  look_.stretch_grain = grain;
  look_.bound_m = bound_m;
}

/// With the state before it.
void ScenarioViewer::measure_moment(const std::shared_ptr<const Snapshot>& state) {
  if (!task_.measures_coherence) return;
  const std::shared_ptr<const Snapshot> before = std::exchange(last_state_, state);
  if (before == nullptr || before->strand_count != state->strand_count ||
      before->vertex_count != state->vertex_count || before->sim_time_ns >= state->sim_time_ns)
    return;
  {
    const std::lock_guard lock(mutex_);
    if (state->sim_time_ns < next_moment_ns_) return;
    next_moment_ns_ = state->sim_time_ns + kMomentNs;
  }
  const double passed_s = static_cast<double>(state->sim_time_ns - before->sim_time_ns) * kSPerNs;
  const std::vector<glm::vec3> from_m = positions_in_head(*before), to_m = positions_in_head(*state);
  const std::vector<glm::dvec3> position_m(to_m.begin(), to_m.end());
  std::vector<glm::dvec3> velocity_mps(position_m.size());
  for (size_t i = 0; i < position_m.size(); ++i)
    velocity_mps[i] = (position_m[i] - glm::dvec3(from_m[i])) / passed_s;
  const Coherence moment =
      measure_coherence({state->strand_count, state->vertex_count, position_m, velocity_mps});
  const double time_s = static_cast<double>(state->sim_time_ns) * kSPerNs;
  const double share = moment.incoherent_share(), order = moment.order();
  const std::lock_guard lock(mutex_);
  SeenCoherence& seen = look_.coherence;
  seen.all += moment;
  const bool is_first = seen.moment_count++ == 0;
  if (is_first || share > seen.worst_share)
    std::tie(seen.worst_share, seen.worst_share_s) = std::pair(share, time_s);
  if (is_first || order < seen.least_order)
    std::tie(seen.least_order, seen.least_order_s) = std::pair(order, time_s);
}

ViewerLook ScenarioViewer::look() const {
  const std::lock_guard lock(mutex_);
  return look_;
}

void ScenarioViewer::begin_absence() {
  const std::lock_guard lock(mutex_);
  frames_before_ = look_.counts.frames;
  look_.back_ns = 0;
}

ViewerPicture ScenarioViewer::picture() const {
  const std::lock_guard lock(mutex_);
  return picture_;
}

void ScenarioViewer::change_link(const ScenarioLink& link) {
  CHECK(relay_ != nullptr);
  chaos::LinkPlan plan = plan_of(link.loss, link.delay_ms);
  relay_->set_plan(chaos::Direction::Up, plan);
  plan.bytes_per_s = static_cast<uint64_t>(link.link_mbit * kBytesPerMbit);
  relay_->set_plan(chaos::Direction::Down, plan);
  relay_->set_frozen(link.fault == ScenarioFault::Stall);
  relay_->set_silent(link.fault == ScenarioFault::HalfOpen);
  if (link.fault != ScenarioFault::Cut) return;
  {
    // What is on its way yet does not count.
    const std::lock_guard lock(mutex_);
    awaits_loss_ = look_.is_connected;
  }
  relay_->reset_all();
}

void ScenarioViewer::begin_measure() {
  const std::lock_guard lock(mutex_);
  look_.largest_stretch = 0.0;
  look_.stretch_place = {};
  look_.largest_head_mps = 0.0;
  look_.coherence = {};
  next_moment_ns_ = 0;
}

}  // namespace strandcast
