// The part of ScenarioRun that checks.
#include <charconv>
#include <cmath>
#include <sstream>
#include <thread>

#include "client/app/scenario/scenario_run.h"
#include "common/base/file.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/pictures/picture_error.h"
#include "common/render/render_device.h"
#include "common/replay/strand_fill.h"
#include "common/replay/strand_replay.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kExpectPoll{50};
constexpr double kUnchangedS = 4.0, kLongestStillS = 30.0;  // without another picture; of waiting for one
constexpr int64_t kOnItsWayNs = 150'000'000;                // for a picture
constexpr size_t kMaxExpectedChars = 300;
constexpr double kRefusalTimeoutS = 10.0;
constexpr size_t kHashChars = 16;
constexpr const char* kNoState = "is unknown: steps alone tell it (start { lockstep: true }, then step)";

std::string wanted_text(const ScenarioMetric& metric) {
  std::string text;
  const auto add = [&](const char* word, const std::optional<double>& value) {
    if (value) text += fmt::format("{}{} {:g}", text.empty() ? "" : " and ", word, *value);
  };
  add("below", metric.below);
  add("above", metric.above);
  add("equal to", metric.equals);
  return metric.within_s > 0.0 ? text + fmt::format(" within {:g} s", metric.within_s) : text;
}

bool holds(const ScenarioMetric& metric, double value) {
  return (!metric.below || value < *metric.below) && (!metric.above || value > *metric.above) &&
         (!metric.equals || value == *metric.equals);
}

/// What is known of why a viewer saw no more frames in a span.
std::string why_few_frames(const MeasuredSpan& span, const MeasuredSpan::Seen& seen) {
  const ViewerLook& look = seen.after;
  if (!look.is_connected) return look.trouble;
  const ViewerCounts &now = look.counts, &before = seen.before;
  const std::string meant =
      look.rate_divisor == 1 ? std::string("each state") : fmt::format("one state of {}", look.rate_divisor);
  std::string text =
      fmt::format("it sees {} ({}); {} is meant for it, and {} came in {:.1f} s ({:.0f} kbit/s)",
                  to_string(look.mode), look.mode_reason, meant, now.frames - before.frames, span.seconds,
                  static_cast<double>(now.received_bytes - before.received_bytes) * kBitsPerByte * 1e-3 /
                      std::max(span.seconds, 1e-6));
  if (span.realtime >= 0.0) text += fmt::format(", at {:.2f} of real time", span.realtime);
  return text;
}

/// What was sent, for a person.
const char* name_of(ScenarioInput input) {
  constexpr const char* kNames[] = {"nothing",
                                    "a wrong token",
                                    "a controller with a viewer's token",
                                    "a viewer that pauses",
                                    "a camera that is not a number",
                                    "an assignment beyond the limit"};
  return kNames[static_cast<size_t>(input)];
}

/// What shows a stretch as small as `limit`, where this bound shows `grain` and no less.
std::string hint_of_bound(double bound_m, double grain, double limit) {
  constexpr auto kFinestM = static_cast<double>(kMinBoundM);
  constexpr double kRoom = 0.9;  // for rounding
  const double wanted_m = bound_m * limit / grain * kRoom;
  if (wanted_m >= kFinestM)
    return fmt::format("set: \"stream.bound_m={:.7f}\" shows so little; over a thin link, a faster one too",
                       wanted_m);
  return fmt::format("no stream.bound_m shows so little: the finest, {:.6f}, shows {:.2g}", kFinestM,
                     grain * kFinestM / bound_m);
}

std::string hash_text(const std::optional<uint64_t>& hash) {
  return hash ? fmt::format("{:016x}", *hash) : std::string("none");
}

/// Links followed.
bool lies_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  std::error_code failure;
  const auto inner = std::filesystem::weakly_canonical(path, failure);
  if (failure) return false;
  auto outer = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, failure);
  if (failure) return false;
  if (!outer.has_filename()) outer = outer.parent_path();  // "folder/"
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace

std::vector<double> find_metric(const std::string& text, const std::string& name) {
  std::vector<double> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const size_t space = line.rfind(' ');
    const std::string_view key = std::string_view(line).substr(0, space);
    const bool is_of_head = key.starts_with(name + "{head=\"") && key.ends_with("\"}") &&
                            key.find("\",") == std::string_view::npos;
    if (space == std::string::npos || (key != name && !is_of_head)) continue;
    double value = 0.0;
    if (std::from_chars(line.data() + space + 1, line.data() + line.size(), value).ec == std::errc())
      values.push_back(value);
  }
  return values;
}

/// For who left out a metric's labels, the first line that has them: quoted, as a scenario may have it.
std::string missing_metric_text(const std::string& text, const std::string& name) {
  constexpr const char* kMissing = "there is no such line in /metrics";
  const size_t at = text.find("\n" + name + "{");
  if (at == std::string::npos) return kMissing;
  return fmt::format("{}, but '{}'", kMissing, text.substr(at + 1, text.find("} ", at) - at));
}

Result<Image> draw(const ViewerPicture& picture, RenderSize size) {
  if (picture.mode == StreamMode::Frames && picture.image != nullptr) return *picture.image;
  if (picture.asset == nullptr || picture.state == nullptr)
    return make_error(ErrorCode::Unavailable, "there is nothing to draw yet");
  ASSIGN_OR_RETURN(const auto device, RenderDevice::open({}));
  ASSIGN_OR_RETURN(const auto renderer, device->make_renderer(*picture.asset, picture.look.look));
  StrandFill fill(picture.asset->rest_position_m, picture.asset->vertex_count);
  RETURN_IF_ERROR(renderer->draw(posed_strands_of(*picture.state, fill), picture.look.camera, size));
  return renderer->read_image();
}

void ScenarioRun::report(const std::string& what, const std::string& wanted, const std::string& measured,
                         bool has_passed, const std::string& detail) {
  const double time_s = elapsed_s();
  const CheckResult check{line_, what, wanted, measured, has_passed, time_s - last_check_s_, detail};
  last_check_s_ = time_s;
  result_.checks.push_back(check);
  if (listener_) listener_(check);
}

Result<ScenarioViewer*> ScenarioRun::viewer(const std::string& name) const {
  if (viewer_order_.empty()) return make_error(ErrorCode::BadInput, "there is no viewer: view comes first");
  const auto found = viewers_.find(name.empty() ? viewer_order_.front() : name);
  if (found == viewers_.end()) return make_error(ErrorCode::BadInput, "there is no viewer '{}'", name);
  return found->second.get();
}

Status ScenarioRun::carry_out(const ScenarioExpect& expect) {
  const bool needs_viewer = expect.stretch_below || expect.picture || expect.kbit_below ||
                            expect.bits_per_vertex_below || expect.hz_above || expect.back_within_s ||
                            expect.head_mps_below || expect.order_above || expect.incoherent_below ||
                            !expect.mode.empty();
  if (needs_viewer) RETURN_IF_ERROR(viewer(expect.viewer));
  if (!expect.same_as.empty() && !remembered_.contains(expect.same_as))
    return make_error(ErrorCode::BadInput, "no state was remembered as '{}': remember comes first",
                      expect.same_as);
  const bool needs_span = expect.stretch_below || expect.kbit_below || expect.bits_per_vertex_below ||
                          expect.hz_above || expect.realtime_above || expect.realtime_below ||
                          expect.feed_pace_within || expect.head_mps_below || expect.order_above ||
                          expect.incoherent_below || expect.cpu_share_below;
  if (needs_span && !span_)
    return make_error(ErrorCode::BadInput, "nothing was measured: a step or run_s comes first");
  const bool needs_states = expect.stretch_below || expect.bits_per_vertex_below || expect.realtime_above ||
                            expect.realtime_below || expect.feed_pace_within || expect.head_mps_below ||
                            expect.order_above || expect.incoherent_below;
  if (needs_states && span_->has_waited)
    return make_error(ErrorCode::BadInput,
                      "nothing was simulated: in lockstep run_s only waits, and step goes on");
  if (needs_span) expect_span(expect);
  if (expect.has_no_quarantine) {
    expect_metric({"strandcast_publish_quarantined_total", {}, {}, 0.0});
    expect_metric({"strandcast_publish_overstretched_total", {}, {}, 0.0});
  }
  expect_state(expect);
  if (expect.back_within_s) expect_back(expect);
  if (expect.is_slow) expect_slow_motion(expect);
  if (!expect.mode.empty()) expect_mode(expect);
  if (expect.picture) expect_picture(expect);
  if (expect.metric) expect_metric(*expect.metric);
  return {};
}

void ScenarioRun::expect_span(const ScenarioExpect& expect) {
  expect_pace(expect);
  if (viewer_order_.empty()) return;
  const std::string name = expect.viewer.empty() ? viewer_order_.front() : expect.viewer;
  const MeasuredSpan::Seen& seen = span_->viewers[name];
  const ViewerCounts& now = seen.after.counts;
  const double seconds = std::max(span_->seconds, 1e-6);
  const auto frames = static_cast<double>(now.frames - seen.before.frames);
  if (expect.head_mps_below)
    report("speed of the head seen by " + name, fmt::format("below {:g} m/s", *expect.head_mps_below),
           now.strand_frames == seen.before.strand_frames
               ? std::string("no strands were decoded")
               : fmt::format("measured {:.2f} m/s", seen.after.largest_head_mps),
           now.strand_frames > seen.before.strand_frames &&
               seen.after.largest_head_mps < *expect.head_mps_below);
  if (expect.stretch_below) expect_stretch(name, seen, *expect.stretch_below);
  if (expect.order_above || expect.incoherent_below) expect_coherence(name, seen.after.coherence, expect);
  add_guide(&TraceSample::stretch, "below", expect.stretch_below);
  add_guide(&TraceSample::hz, "above", expect.hz_above);
  add_guide(&TraceSample::kbit, "below", expect.kbit_below);
  if (expect.hz_above)
    report("frames per second of " + name, fmt::format("above {:g}", *expect.hz_above),
           fmt::format("measured {:.1f}", frames / seconds), frames / seconds > *expect.hz_above,
           why_few_frames(*span_, seen));
  if (expect.kbit_below) {
    const double kbit =
        static_cast<double>(now.received_bytes - seen.before.received_bytes) * kBitsPerByte * 1e-3 / seconds;
    report("kbit/s to " + name, fmt::format("below {:g}", *expect.kbit_below),
           fmt::format("measured {:.1f}", kbit), kbit < *expect.kbit_below);
  }
  if (!expect.bits_per_vertex_below) return;
  const auto vertices = static_cast<double>(now.strand_frames - seen.before.strand_frames) *
                        static_cast<double>(seen.after.vertices);
  const double bits = static_cast<double>(now.strand_bytes - seen.before.strand_bytes) * kBitsPerByte /
                      std::max(vertices, 1.0);
  report("bits per vertex to " + name, fmt::format("below {:g}", *expect.bits_per_vertex_below),
         vertices > 0.0 ? fmt::format("measured {:.3f} by {}", bits, seen.after.codec)
                        : std::string("no strands were decoded"),
         vertices > 0.0 && bits < *expect.bits_per_vertex_below);
}

/// What is wanted, for the plot.
void ScenarioRun::add_guide(double TraceSample::*measure, const char* word,
                            const std::optional<double>& value) {
  if (value) result_.wanted.push_back({measure, fmt::format("wanted {} {:g}", word, *value), *value});
}

/// How fast the simulation went, and with it what was fed.
void ScenarioRun::expect_pace(const ScenarioExpect& expect) {
  const std::string measured = span_->realtime < 0.0
                                   ? std::string("measured nothing: run for two seconds at least")
                                   : fmt::format("measured {:.3f}", span_->realtime);
  add_guide(&TraceSample::realtime, "above", expect.realtime_above);
  add_guide(&TraceSample::realtime, "below", expect.realtime_below);
  if (expect.realtime_above)
    report("simulated over real time", fmt::format("above {:g}", *expect.realtime_above), measured,
           span_->realtime > *expect.realtime_above, excerpt(status_.slow_motion, kMaxExpectedChars));
  if (expect.realtime_below)
    report("simulated over real time", fmt::format("below {:g}", *expect.realtime_below), measured,
           span_->realtime >= 0.0 && span_->realtime < *expect.realtime_below);
  if (expect.cpu_share_below)
    report("processor share of the server",
           fmt::format("below {:g} of one processor", *expect.cpu_share_below),
           span_->cpu_share < 0.0 ? std::string("the server does not say what it takes")
                                  : fmt::format("measured {:.3f}", span_->cpu_share),
           span_->cpu_share >= 0.0 && span_->cpu_share < *expect.cpu_share_below,
           "strandcast-server --explain says what costs most");
  if (!expect.feed_pace_within) return;
  const bool is_measured = span_->feed_pace >= 0.0 && span_->realtime >= 0.0;
  report("what is fed beside the simulation", fmt::format("within {:g}", *expect.feed_pace_within),
         is_measured
             ? fmt::format("measured {:.3f} beside {:.3f} of real time", span_->feed_pace, span_->realtime)
             : std::string("measured nothing: feed in real time, and run for two seconds at least"),
         is_measured && std::abs(span_->feed_pace - span_->realtime) <= *expect.feed_pace_within);
}

bool ScenarioRun::await(double seconds, const std::function<bool()>& condition) {
  const double begin_s = elapsed_s();
  while (!condition()) {
    if (elapsed_s() - begin_s >= seconds || !go_on()) return false;
    // What else comes meanwhile is not to pile up.
    for (const ClientEvent& event : client_->wait(kExpectPoll)) take(event);
    trace();
  }
  return true;
}

void ScenarioRun::expect_slow_motion(const ScenarioExpect& expect) {
  const auto says_slow = [this] { return status_ns_ != 0 && !status_.slow_motion.empty(); };
  const bool is_so = await(expect.within_s, [&] { return says_slow() == *expect.is_slow; });
  report("what the server says", *expect.is_slow ? "slow motion" : "real time",
         says_slow() ? excerpt(status_.slow_motion, kMaxExpectedChars)
                     : std::string("it does not say that it is slow"),
         is_so);
}

void ScenarioRun::expect_mode(const ScenarioExpect& expect) {
  const ScenarioViewer& who = **viewer(expect.viewer);
  const bool is_so = await(expect.within_s, [&] {
    const ViewerLook look = who.look();
    return expect.mode == to_string(look.mode) && look.mode_reason.find(expect.because) != std::string::npos;
  });
  const ViewerLook look = who.look();
  const std::string wanted =
      expect.because.empty() ? expect.mode : fmt::format("{}, because '{}'", expect.mode, expect.because);
  report("mode of " + who.view().name, wanted,
         fmt::format("it sees {} ({})", to_string(look.mode), look.mode_reason), is_so);
}

void ScenarioRun::expect_stretch(const std::string& name, const MeasuredSpan::Seen& seen, double limit) {
  const bool has_seen = seen.after.counts.strand_frames > seen.before.strand_frames;
  const double stretch = seen.after.largest_stretch, grain = seen.after.stretch_grain;
  const bool is_too_fine = limit <= grain;
  const bool has_passed = has_seen && !is_too_fine && stretch < limit;
  const std::string measured = has_seen ? fmt::format("measured {:.2g} (seen within {:.2g})", stretch, grain)
                                        : std::string("no strands were decoded");
  std::string detail;
  if (has_seen && !has_passed) {
    const StretchPlace& place = seen.after.stretch_place;
    std::vector<std::string> hints;
    if (stretch >= std::max(limit, grain))
      hints.emplace_back("more substeps, or quality=full, stretch hair less");
    if (is_too_fine) hints.push_back(hint_of_bound(seen.after.bound_m, grain, limit));
    detail = fmt::format("at strand {}, from vertex {} to {}, {:.3f} s (state {}): {}", place.strand,
                         place.vertex, place.vertex + 1, place.time_s, place.tick, fmt::join(hints, "; "));
  }
  report("stretch of " + name, fmt::format("below {:g}", limit), measured, has_passed, detail);
}

void ScenarioRun::expect_coherence(const std::string& name, const SeenCoherence& seen,
                                   const ScenarioExpect& expect) {
  const bool has_seen = seen.moment_count > 0;
  const auto told = [&](double all, double worst, double worst_s) {
    return has_seen ? fmt::format(
                          "measured {:.3f} over {} moments, {:.3f} at {:.2f} s the worst (hair moves "
                          "at {:.3f} m/s)",
                          all, seen.moment_count, worst, worst_s, seen.all.motion_mps())
                    : std::string("fewer than two states were decoded");
  };
  const double order = seen.all.order(), share = seen.all.incoherent_share();
  if (expect.order_above)
    report("order of hair seen by " + name, fmt::format("above {:g}", *expect.order_above),
           told(order, seen.least_order, seen.least_order_s), has_seen && order > *expect.order_above,
           "hair that sticks together (volume) keeps its order");
  if (expect.incoherent_below)
    report("incoherent motion of hair seen by " + name, fmt::format("below {:g}", *expect.incoherent_below),
           told(share, seen.worst_share, seen.worst_share_s), has_seen && share < *expect.incoherent_below,
           "a finer stream.bound_m rounds less; hair that sticks together (volume) moves together");
}

/// Compares with the hash that a file has, or writes it there.
void ScenarioRun::expect_kept_state(const std::filesystem::path& path) {
  const std::string what = fmt::format("state at step {}", tick_);
  const std::string measured = "is " + hash_text(hash_);
  if (options_.renews_goldens && hash_) {
    if (!lies_below(path, scenario_.folder))
      return report(what, "written anew",
                    fmt::format("{} does not lie below the scenario's folder", path.string()), false);
    const std::string text = hash_text(hash_) + "\n";
    const Status saved = save_file(path, std::as_bytes(std::span(text)));
    return report(what, "written anew", saved ? measured : saved.error().to_string(), saved.ok());
  }
  const auto kept = load_text(path, kMaxExpectedChars);
  if (!kept)
    return report(what, "as in " + path.string(), kept.error().to_string() + " (--renew writes it)", false);
  const std::string wanted(trimmed(std::string_view(*kept).substr(0, kept->find('\n'))));
  if (!hash_) return report(what, "as in " + path.string(), kNoState, false);
  const bool is_same = wanted == hash_text(hash_);
  report(what, fmt::format("{} of {}", excerpt(wanted, kHashChars), path.filename().string()), measured,
         is_same, is_same ? "" : "solver, groom, inputs or compiler are others than when it was written");
}

void ScenarioRun::expect_state(const ScenarioExpect& expect) {
  if (!expect.hash_file.empty()) expect_kept_state(expect.hash_file);
  if (!expect.hash && expect.same_as.empty()) return;
  std::optional<uint64_t> wanted = expect.hash;
  if (const auto found = remembered_.find(expect.same_as); found != remembered_.end()) wanted = found->second;
  const std::string from = expect.same_as.empty() ? std::string() : fmt::format(" of '{}'", expect.same_as);
  report(fmt::format("state at step {}", tick_), hash_text(wanted) + from,
         hash_ ? "is " + hash_text(hash_) : kNoState, wanted.has_value() && hash_ == wanted);
}

/// It counts from the change, however late it is asked for.
void ScenarioRun::expect_back(const ScenarioExpect& expect) {
  const ScenarioViewer& who = **viewer(expect.viewer);
  const std::string& name = who.view().name;
  const double within_s = *expect.back_within_s;
  const auto changed = absent_since_ns_.find(name);
  const bool was_away = changed != absent_since_ns_.end();
  const auto seconds_to = [&](int64_t time_ns) {
    return static_cast<double>(time_ns - changed->second) * kSPerNs;
  };
  while (was_away && who.look().back_ns == 0 && seconds_to(now_ns()) < within_s && go_on())
    std::this_thread::sleep_for(milliseconds(10));
  const ViewerLook look = who.look();
  const bool is_there = was_away && look.back_ns != 0;
  report(name + " comes back", fmt::format("within {:g} s", within_s),
         !was_away               ? std::string("neither its server was restarted nor its link changed")
         : is_there              ? fmt::format("was back after {:.2f} s", seconds_to(look.back_ns))
         : !look.trouble.empty() ? fmt::format("is away: {}", look.trouble)
                                 : fmt::format("is away: connected, and no frame has come since{}",
                                               is_lockstep_ ? ": in lockstep, a step brings one" : ""),
         is_there && seconds_to(look.back_ns) <= within_s);
}

/// In lockstep: the finest picture of the last step, by the newest look. What was on its way when that look
/// was set does not count. A step after which nothing looks other brings no picture.
ViewerPicture ScenarioRun::still_picture(const ScenarioViewer& who) {
  ViewerPicture seen = who.picture();
  if (!is_lockstep_ || seen.mode != StreamMode::Frames) return seen;
  const double step_ns = kNsPerS / client_->welcome().step_rate_hz;
  const double wanted_ns = static_cast<double>(tick_) * step_ns;
  double changed_s = elapsed_s();
  await(kLongestStillS, [&] {
    ViewerPicture next = who.picture();
    if (next.image != seen.image) changed_s = elapsed_s();
    seen = std::move(next);
    const bool is_of_step =
        std::abs(static_cast<double>(seen.image_sim_time_ns) - wanted_ns) <= 0.5 * step_ns;
    const bool is_final = seen.is_image_still && is_of_step && seen.image_seen_ns > acted_ns_ + kOnItsWayNs;
    return is_final || elapsed_s() >= changed_s + kUnchangedS;
  });
  return seen;
}

void ScenarioRun::expect_picture(const ScenarioExpect& expect) {
  const ScenarioViewer& who = **viewer(expect.viewer);
  const std::string what = "picture of " + who.view().name;
  const std::filesystem::path& golden_path = expect.picture->golden;
  const std::string wanted =
      fmt::format("within {:g} dB of {}", expect.picture->db_above, golden_path.filename().string());
  const auto seen = draw(still_picture(who), {who.view().width, who.view().height});
  if (!seen) return report(what, wanted, seen.error().to_string(), false);
  // Others that share it compare with what the first of them wrote.
  if (options_.renews_goldens && renewed_.insert(golden_path).second) {
    if (!lies_below(golden_path, scenario_.folder))
      return report(what, "written anew",
                    fmt::format("{} does not lie below the scenario's folder", golden_path.string()), false);
    std::error_code ignored;  // save_png() says what is wrong with the folder
    std::filesystem::create_directories(golden_path.parent_path(), ignored);
    const Status saved = save_png(golden_path, *seen);
    return report(what, "written anew", saved ? golden_path.string() : saved.error().to_string(), saved.ok());
  }
  const auto golden = load_png(golden_path);
  if (!golden) return report(what, wanted, golden.error().to_string() + " (--renew writes it)", false);
  const PictureMask all(size_t{golden->width} * golden->height, 1);
  const auto error = picture_error(*seen, *golden, all);
  const bool is_near = error && error->psnr_db > expect.picture->db_above;
  report(what, wanted, error ? fmt::format("measured {:.1f} dB", error->psnr_db) : error.error().to_string(),
         is_near);
  if (is_near) return;
  std::error_code ignored;
  std::filesystem::create_directories(options_.out, ignored);
  const std::string stem = fmt::format("{}_line{}", scenario_.name, line_);
  (void)save_png(options_.out / (stem + "_seen.png"), *seen);
  (void)save_png(options_.out / (stem + "_golden.png"), *golden);
  if (seen->rgba.size() != golden->rgba.size()) return;
  constexpr int kAmplified = 4;
  Image difference = *seen;
  for (size_t i = 0; i < difference.rgba.size(); ++i)
    difference.rgba[i] = i % 4 == 3
                             ? uint8_t{255}
                             : static_cast<uint8_t>(std::min(
                                   255, kAmplified * std::abs(int{seen->rgba[i]} - int{golden->rgba[i]})));
  (void)save_png(options_.out / (stem + "_difference.png"), difference);
}

void ScenarioRun::expect_metric(const ScenarioMetric& metric) {
  std::string measured;
  const bool has_passed = await(metric.within_s, [&] {
    const auto text = metrics();
    if (!text) return measured = text.error().to_string(), false;
    const std::vector<double> found = find_metric(*text, metric.name);
    measured = found.empty() ? missing_metric_text(*text, metric.name)
                             : fmt::format("is {:g}", fmt::join(found, ", "));
    return !found.empty() &&
           std::all_of(found.begin(), found.end(), [&](double value) { return holds(metric, value); });
  });
  report(metric.name, wanted_text(metric), measured, has_passed);
}

namespace {

/// What the server says to whoever sends this after its Welcome.
std::string answer_to(const ClientConfig& config, const ClientMessage& message) {
  auto client = ViewerClient::connect(config);
  if (!client) return client.error().to_string();
  if (const Status sent = (*client)->send(message); !sent) return sent.error().to_string();
  const int64_t end_ns = now_ns() + static_cast<int64_t>(kRefusalTimeoutS * 1e9);
  while (now_ns() < end_ns)
    for (const ClientEvent& event : (*client)->wait(milliseconds(20)))
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error.to_string();
  return {};
}

ClientMessage wrong_message(ScenarioInput input) {
  if (input == ScenarioInput::NotANumber) {
    CameraChange camera;
    camera.camera.offset_m.x = std::nanf("");
    return camera;
  }
  if (input == ScenarioInput::Overlong) return SetParameter{std::string(kMaxAssignmentBytes + 1, 'x')};
  return ControlCommand{Command::Pause};
}

}  // namespace

Status ScenarioRun::carry_out(const ScenarioRefusal& refusal) {
  std::string answer;
  const bool is_assignment = !refusal.assignment.empty();
  if (is_assignment) {
    ASSIGN_OR_RETURN(const Notice notice, ask(SetParameter{refusal.assignment}));
    if (notice.is_error) answer = notice.text;
  } else {
    const bool is_overlong = refusal.input == ScenarioInput::Overlong;
    ASSIGN_OR_RETURN(ClientConfig config, config_for(is_overlong ? Role::Controller : Role::Viewer));
    config.hello.name = "refused";
    config.hello.gets_no_stream = true;
    if (refusal.input == ScenarioInput::WrongToken) config.hello.token = "no-token-of-this-server";
    if (refusal.input == ScenarioInput::WrongRole) config.hello.role = Role::Controller;
    answer = answer_to(config, wrong_message(refusal.input));
  }
  const bool is_said = !answer.empty() && answer.find(refusal.says) != std::string::npos;
  report(is_assignment ? "set " + excerpt(refusal.assignment, 80) : name_of(refusal.input),
         refusal.says.empty() ? std::string("refused with a sentence")
                              : fmt::format("refused: '{}'", refusal.says),
         answer.empty() ? std::string("it was not refused")
                        : "the server says: " + excerpt(answer, kMaxExpectedChars),
         is_said);
  // And goes on as if nothing had been.
  const auto text = metrics();
  if (!text) report("the server after it", "answers", text.error().to_string(), false);
  return {};
}

void ScenarioRun::save_evidence() {
  std::error_code failure;
  std::filesystem::create_directories(options_.out, failure);
  const std::string plot = to_plot(result_);
  (void)save_file(options_.out / (scenario_.name + "_plot.svg"), std::as_bytes(std::span(plot)));
  for (const auto& [name, viewer] : viewers_)
    if (const auto seen = draw(viewer->picture(), {viewer->view().width, viewer->view().height}))
      (void)save_png(options_.out / fmt::format("{}_{}.png", scenario_.name, name), *seen);
  for (const auto& [process, ending] :
       {std::pair(server_.get(), "_server.log"), {relay_.get(), "_relay.log"}})
    if (process != nullptr)
      std::filesystem::copy_file(process->log_file(), options_.out / (scenario_.name + ending),
                                 std::filesystem::copy_options::overwrite_existing, failure);
}

}  // namespace strandcast
