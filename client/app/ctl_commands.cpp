#include "client/app/ctl_commands.h"

#include <unistd.h>

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>
#include <variant>

#include "client/app/hair_origin.h"
#include "client/app/ltc.h"
#include "client/app/notice_list.h"
#include "client/app/save_scene.h"
#include "client/app/steady_client.h"
#include "client/app/stream_check.h"
#include "client/app/view_options.h"
#include "client/net/http_get.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/client/client_token.h"
#include "common/client/datagram_sender.h"
#include "common/kernels/step_speed.h"
#include "common/motion/mocap_packet.h"
#include "common/motion/wind_csv.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAnswerTimeout{5000};
constexpr milliseconds kHealthTimeout{3000};
constexpr float kGustLengthM = 9.0f;
constexpr FrameRate kUsualTimecodeFps{24, 1};
constexpr double kLongWaitS = 0.5;    // less is what a connection takes
constexpr double kLeastFeedS = 0.01;  // 0 is without end
constexpr int64_t kInputsIntervalNs = 2'000'000'000;
constexpr size_t kMaxInputLineChars = 1'000;
constexpr size_t kMaxShownValues = 6;  // of one input, so that the lines of two fit into their budget

Result<Address> address_of(const CtlTarget& target) {
  ASSIGN_OR_RETURN(Address address, parse_address(target.connect));
  address.is_tls = address.is_tls || target.is_tls || !target.tls_authorities.empty();
  return address;
}

/// Why to wait no longer, if somebody stopped the program.
std::optional<Error> stopped(const CtlTarget& target) {
  if (target.stop == nullptr || !*target.stop) return std::nullopt;
  return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
}

/// To say or to hear something, not to watch: no strand is sent for it.
Result<ClientConfig> speaking_config(const CtlTarget& target, Role role) {
  ASSIGN_OR_RETURN(ClientConfig config, client_config_for(target, role));
  config.hello.gets_no_stream = true;
  return config;
}

Result<std::unique_ptr<ViewerClient>> connect(const CtlTarget& target, Role role) {
  ASSIGN_OR_RETURN(const ClientConfig config, speaking_config(target, role));
  return connect_patiently(config);
}

// ---- feed ----

/// t wrapped into the duration when looped; a series clamps by itself.
double wrapped(double t_s, double duration_s, bool is_looped) {
  return is_looped && duration_s > 0.0 ? std::fmod(t_s, duration_s) : t_s;
}

/// Where the head looks on the mean, rad from +Z towards +X; nothing where it looks all around.
std::optional<double> mean_facing_rad(const MotionClip& clip) {
  constexpr double kLeastTogether = 0.5;
  glm::dvec3 sum(0.0);
  for (const Pose& pose : clip.world_from_head) sum += pose.rotation * glm::dvec3(0, 0, 1);
  const double count = static_cast<double>(clip.world_from_head.size());
  if (std::hypot(sum.x, sum.z) < kLeastTogether * count) return std::nullopt;
  return std::atan2(sum.x, sum.z);
}

/// What a clip was taken for, in one sentence.
std::string taken_for(const MotionClip& clip) {
  const auto [lowest, highest] =
      std::minmax_element(clip.world_from_head.begin(), clip.world_from_head.end(),
                          [](const Pose& a, const Pose& b) { return a.position_m.y < b.position_m.y; });
  std::string facing = "all around";
  if (const std::optional<double> facing_rad = mean_facing_rad(clip)) {
    const double deg = std::round(glm::degrees(*facing_rad));
    facing = deg == 0.0 ? "ahead on the mean" : fmt::format("{} degrees from +Z towards +X on the mean", deg);
  }
  return fmt::format(
      "{} frames, {} per second; one unit is {:.4g} m and {} is up: the head is {:.2f} to {:.2f} m up, and "
      "looks {}",
      clip.world_from_head.size(), frame_rate_text(1.0 / clip.frame_s), clip.file_unit_m, clip.up,
      lowest->position_m.y, highest->position_m.y, facing);
}

void print_notes(const FeedOptions& options, const MotionFile& file) {
  const auto is_told_last = [&](const std::string& note) {
    return options.is_checking &&
           std::find(file.unlikely.begin(), file.unlikely.end(), note) != file.unlikely.end();
  };
  for (const std::string& note : file.notes)
    if (!is_told_last(note)) std::cerr << note << '\n';
}

/// What is called front, left, right and back of the head is so of the clip's mean facing. Returns the turn.
glm::dquat turned_ahead(MotionClip& clip) {
  constexpr double kAsideRad = 0.02;  // less is ahead
  const double facing_rad = mean_facing_rad(clip).value_or(0.0);
  if (std::abs(facing_rad) < kAsideRad) return {1, 0, 0, 0};
  const Pose turn{{}, glm::angleAxis(-facing_rad, glm::dvec3(0, 1, 0))};
  for (Pose& pose : clip.world_from_head) pose = {turn * pose.position_m, turn.rotation * pose.rotation};
  return turn.rotation;
}

/// The head under curves that move as one.
Result<MotionFile> clip_of_curves(const FeedOptions& options, const FindHair& find_hair) {
  const auto curves = load_abc_motion(options.motion);
  if (!curves) return curves.error();
  if (!find_hair)
    return at(options.motion, make_error(ErrorCode::BadInput,
                                         "curves move the hair of a server's file: only feed to a server, "
                                         "and bake, know it"));
  ASSIGN_OR_RETURN(const HairOrigin hair, find_hair());
  MotionFile loaded = head_motion(*curves, hair, options.motion, options.motion_file);
  print_notes(options, loaded);
  return loaded;
}

/// The motion of a BVH file; `turn` is what it was turned by.
Result<MotionFile> clip_of_file(const FeedOptions& options, glm::dquat& turn) {
  MotionFileOptions file = options.motion_file;
  file.has_body = true;
  if (!options.fps.empty()) {
    ASSIGN_OR_RETURN(const FrameRate fps, parse_frame_rate(options.fps));
    file.fps = fps.hz();
  }
  ASSIGN_OR_RETURN(MotionFile loaded, load_motion_file(options.motion, file));
  constexpr double kSameRate = 1e-3;
  const double own_hz = 1.0 / loaded.clip.frame_s;
  if (file.fps > 0.0 && options.timecode.empty() && options.ltc.empty() &&
      std::abs(own_hz / file.fps - 1.0) > kSameRate)
    std::cerr << fmt::format("{}: it has {} frames per second, and --fps {} is left out\n", options.motion,
                             frame_rate_text(own_hz), options.fps);
  print_notes(options, loaded);
  if (!options.is_keeping_facing) turn = turned_ahead(loaded.clip);
  if (turn.w < 1.0)
    std::cerr << fmt::format(
        "{}: turned by {:.0f} degrees, and a file of wind with it: then the head looks ahead "
        "on the mean (--keep-facing leaves it)\n",
        options.motion, glm::degrees(2.0 * std::atan2(turn.y, turn.w)));
  return loaded;
}

/// Adds motion; `turn` is what it was turned by.
Status add_motion(const FeedOptions& options, const FindHair& find_hair, FeedPlan& plan, double& length_s,
                  glm::dquat& turn) {
  if (options.motion == "none") return {};
  if (options.motion == "builtin") {
    plan.motion = [blend_s = options.blend_s](double t_s) {
      return built_in_motion(time_from_rest_s(t_s, blend_s));
    };
    return {};
  }
  ASSIGN_OR_RETURN(MotionFile file, is_of_curves(options.motion) ? clip_of_curves(options, find_hair)
                                                                 : clip_of_file(options, turn));
  plan.taken = fmt::format("{}: {}", options.motion, taken_for(file.clip));
  plan.unlikely = std::move(file.unlikely);
  const auto path = std::make_shared<const ClipPath>(std::move(file.clip),
                                                     ClipPathOptions{options.is_looped, options.blend_s});
  length_s = path->duration_s();
  if (path->clip().world_from_head.size() == 1) {
    length_s = 0.0;
    std::cerr << fmt::format("{}: one frame: the head is held there\n", options.motion);
  }
  if (path->way_back_s() > 0.0)
    std::cerr << fmt::format("{}: the way back to its start takes {:.2f} s\n", options.motion,
                             path->way_back_s());
  plan.motion = [path](double t_s) { return path->sample(t_s); };
  const std::vector<std::string>& joints = path->clip().joint_name;
  if (joints.empty()) return {};
  std::cerr << fmt::format("{}: joints of the body: {}\n", options.motion, fmt::join(joints, ", "));
  plan.joint_names = joints;
  plan.joints = [path](double t_s) { return path->sample_joints(t_s); };
  return {};
}

Status add_wind(const FeedOptions& options, FeedPlan& plan, const glm::dquat& turn) {
  if (options.wind == "none") return {};
  if (options.wind == "gusts") {
    auto gusts = std::make_shared<const GustGenerator>(options.wind_mps, options.gust_intensity, kGustLengthM,
                                                       options.seed);
    plan.wind = [gusts](double t_s) { return gusts->sample(t_s); };
    return {};
  }
  ASSIGN_OR_RETURN(WindSeries loaded, load_wind_csv(options.wind));
  for (const std::string& repair : loaded.repairs) std::cerr << options.wind << ": " << repair << '\n';
  auto series = std::make_shared<const WindSeries>(std::move(loaded));
  plan.wind = [series, turn, is_looped = options.is_looped](double t_s) {
    const glm::dvec3 wind_mps(series->sample(wrapped(t_s, series->duration_s(), is_looped)));
    return glm::vec3(turn * wind_mps);
  };
  return {};
}

}  // namespace

int ctl_failure(const Error& error, int exit_code) {
  std::cerr << "strandcast-ctl: " << error.to_string() << '\n';
  return exit_code;
}

bool is_of_curves(const std::string& motion) {
  return std::filesystem::path(motion).extension() == ".abc";
}

Result<FeedPlan> make_feed_plan(const FeedOptions& options, const FindHair& find_hair) {
  FeedPlan plan;
  plan.rate_hz = options.rate_hz;
  plan.speed = options.speed;
  std::optional<FrameRate> fps;
  if (!options.fps.empty()) {
    ASSIGN_OR_RETURN(fps, parse_frame_rate(options.fps));
  }
  if (!options.timecode.empty()) {
    ASSIGN_OR_RETURN(const Timecode first, parse_timecode(options.timecode, fps.value_or(kUsualTimecodeFps)));
    plan.timecode = [first](double t_s) { return advanced(first, t_s * first.rate.hz()); };
  }
  if (!options.ltc.empty()) {
    ASSIGN_OR_RETURN(plan.timecode, open_ltc(options.ltc, fps, [](const std::string& sentence) {
                       std::cerr << sentence + '\n';
                     }));
  }
  double length_s = 0.0;  // of a motion file; 0 = without end
  glm::dquat turn(1, 0, 0, 0);
  RETURN_IF_ERROR(add_motion(options, find_hair, plan, length_s, turn));
  RETURN_IF_ERROR(add_wind(options, plan, turn));
  if (!plan.motion && !plan.wind && !plan.timecode)
    return make_error(ErrorCode::BadInput, "nothing to feed: both --motion and --wind are none");
  plan.is_live = options.is_live;
  plan.duration_s = options.seconds;
  if (plan.duration_s == 0.0 && !options.is_looped) plan.motion_s = length_s;
  return plan;
}

namespace {

void print_progress(const FeedProgress& progress) {
  const std::string pace =
      progress.pace < 1.0 ? fmt::format(", at {:.2f} of real time with the simulation", progress.pace) : "";
  std::cerr << fmt::format("\r  {:7.1f} s, {} motion and {} wind samples{:<46}", progress.elapsed_s,
                           progress.motion_samples, progress.wind_samples, pace)
            << std::flush;
}

// ---- the others ----

/// " | 3 things" for a count that is not zero.
std::string some(uint64_t count, const std::string& things) {
  return count > 0 ? fmt::format(" | {} {}", count, things) : "";
}

std::string to_line(const ServerStatus& status) {
  return fmt::format(
      "tick {:8} | step {:6.2f} ms | encode {:5.2f} ms | render {:6.2f} ms | x{:.2f} real time | {} "
      "viewer{}{}{}{}{}{}{}{}",
      status.tick, status.sim_ms, status.encode_ms, status.render_ms, status.realtime_factor,
      status.viewer_count, status.viewer_count == 1 ? "" : "s", status.is_paused ? " | paused" : "",
      status.is_motion_stale ? " | no motion" : "", some(status.rejected_samples, "samples rejected"),
      some(status.quarantined_strands, "strands broken"),
      some(status.overstretched_strands, "strands over-stretched"),
      status.timecode ? " | " + timecode_text(*status.timecode) : "",
      status.recording.empty() ? "" : " | recording " + status.recording);
}

/// A live input in a few lines: how it comes, what went wrong, and the newest packet as it was sent.
std::vector<std::string> to_lines(const LiveInputStatus& input) {
  std::vector<std::string> lines;
  const std::string sender = input.sender.empty() ? "nobody sends" : "from " + input.sender;
  const std::string subject = input.subject.empty() ? "" : fmt::format(" | head: {}", input.subject);
  const std::string others = input.subjects.empty() || input.subjects == input.subject
                                 ? ""
                                 : fmt::format(" (seen: {})", input.subjects);
  lines.push_back(fmt::format("  {} | {}{}{}{}{} | {:.1f} packets/s, jitter {:.1f} ms, age {:.0f} ms",
                              input.input, sender, subject, others, input.is_stale ? " | stale" : "",
                              input.is_calibrated ? " | calibrated" : "", input.rate_hz, input.jitter_ms,
                              input.age_ms));
  const std::string counts = some(input.malformed, "malformed") + some(input.refused, "refused") +
                             some(input.over_rate, "too many") + some(input.impossible, "impossible") +
                             some(input.clamped, "clamped") + some(input.gated, "not believed") +
                             some(input.resequenced, "put in order") + some(input.late, "late or twice") +
                             some(input.lost, "lost");
  lines.push_back(fmt::format("    {} packets, {} bytes{}", input.packets, input.received_bytes, counts));
  for (size_t i = 0; i < std::min(input.values.size(), kMaxShownValues); ++i)
    lines.push_back("    " + input.values[i].text);
  if (input.values.size() > kMaxShownValues)
    lines.push_back(fmt::format("    and {} more", input.values.size() - kMaxShownValues));
  return lines;
}

/// A foreign text, fit for a terminal.
void print_lines(const std::string& text) {
  constexpr int kMaxShownLines = 100;
  constexpr size_t kMaxShownChars = 200;
  std::istringstream lines(text);
  std::string line;
  for (int i = 0; i < kMaxShownLines && std::getline(lines, line); ++i)
    std::cout << one_line(line, kMaxShownChars) << '\n';
}

std::string to_table(const SessionList& list) {
  std::string text = fmt::format("{:>8}  {:<10}  {:<7}  {:>12}  {:>8}  {:>8}  {:<20}  {}\n", "session",
                                 "role", "mode", "sent bytes", "delay ms", "since s", "address", "name");
  for (const SessionInfo& session : list.sessions)
    text += fmt::format("{:>8}  {:<10}  {:<7}  {:>12}  {:>8.1f}  {:>8.1f}  {:<20}  {}\n", session.id,
                        to_string(session.role), to_string(session.mode), session.sent_bytes,
                        session.queue_delay_ms, session.connected_s, session.address, session.name);
  return text;
}

}  // namespace

Result<ClientConfig> client_config_for(const CtlTarget& target, Role role) {
  ClientConfig config;
  ASSIGN_OR_RETURN(config.address, address_of(target));
  config.tls_authorities = target.tls_authorities;
  config.hello.role = role;
  config.hello.mode = StreamMode::Strands;
  config.hello.name = "strandcast-ctl";
  config.hello.token = target.token;
  config.hello.head = target.head;
  config.cancel = [target] { return stopped(target); };
  if (!target.token_file.empty()) {
    ASSIGN_OR_RETURN(config.hello.token, load_token(target.token_file, role));
  }
  return config;
}

namespace {

FeedListener progress_listener() {
  return isatty(STDERR_FILENO) != 0 ? FeedListener(print_progress) : FeedListener();
}

/// The hair of the server's scene, which curves move.
Result<HairOrigin> hair_of(const CtlTarget& target) {
  ASSIGN_OR_RETURN(const SceneDesc scene, ask_scene(target));
  const auto* const files = std::get_if<FileGroomDesc>(&scene.groom);
  if (files == nullptr)
    return make_error(ErrorCode::BadInput, "curves move the hair of a file, and the server's hair was grown");
  return load_place(*files);
}

std::string timecode_line(const FeedOptions& options) {
  return options.timecode.empty() ? "" : fmt::format("timecode from {} on\n", options.timecode);
}

/// Says what a check has found. Returns the exit code.
int tell_taken(const FeedPlan& plan) {
  std::cout << plan.taken << '\n';
  if (plan.unlikely.empty()) return kDoneExit;
  return ctl_failure(make_error(ErrorCode::BadInput, "{}", fmt::join(plan.unlikely, "; ")), kRefusedExit);
}

/// As a program of motion capture would.
int run_mocap_feed(const FeedOptions& options, const FeedPlan& plan, const std::atomic<bool>& stop) {
  const auto encoding = find_mocap_encoding(options.as);
  if (!encoding) return ctl_failure(at("--as", encoding.error()));
  if (plan.timecode && !encoding->has_timecode)
    return ctl_failure(make_error(
        ErrorCode::BadInput, "{} carries no timecode: leave --timecode and --ltc out, or send opentrackio",
        encoding->name));
  // What names no port gets the protocol's own.
  auto to = parse_address(options.to);
  if (!to) return ctl_failure(to.error());
  if (to->to_string() != options.to) to->port = encoding->port;
  auto sender = DatagramSender::open(*to);
  if (!sender) return ctl_failure(sender.error());
  std::cerr << fmt::format("sending {} to {}: motion {}, {} packets per second\n", encoding->name,
                           to->to_string(), options.motion, options.rate_hz)
            << timecode_line(options);
  uint32_t number = 0;
  const auto send = [&](MocapMoment moment) {
    moment.number = number++;
    moment.rate_hz = options.rate_hz;
    return (*sender)->send(encoding->encode(moment));
  };
  const FeedProgress done = feed_moments(send, plan, stop, progress_listener());
  std::cout << fmt::format("sent {:.1f} s: {} packets, at most {:.1f} ms late, {} skipped, {} unsent\n",
                           done.elapsed_s, done.motion_samples, done.worst_lateness_ms, done.skipped_samples,
                           done.unsent_samples);
  return kDoneExit;
}

/// Says what became of a feed to a server. Returns the exit code.
int tell_fed(const FeedProgress& done, double speed) {
  if (const std::string slow = slow_motion_sentence(done, speed); !slow.empty()) std::cout << slow << '\n';
  std::cout << fmt::format(
      "fed {:.1f} s: {} motion and {} wind samples, at most {:.1f} ms late, {} skipped, {} unsent, {} "
      "rejected of all sources since the server began\n",
      done.elapsed_s, done.motion_samples, done.wind_samples, done.worst_lateness_ms, done.skipped_samples,
      done.unsent_samples, done.rejected_samples);
  if (done.reconnects > 0)
    std::cout << fmt::format("reconnects {}, outage_s {:.1f}\n", done.reconnects, done.outage_s);
  if (done.gone_s == 0.0 && done.reconnects > 0) std::cout << gone_sentence(done) << '\n';
  if (!done.last_notice.empty()) std::cout << "the server says: " << done.last_notice << '\n';
  if (done.gone_s > 0.0 && done.unsent_samples > 0)
    return ctl_failure(make_error(ErrorCode::Unavailable, "{}", gone_sentence(done)), kRefusedExit);
  if (const std::string refused = refusal_sentence(done); !refused.empty())
    return ctl_failure(make_error(ErrorCode::BadInput, "{}", refused), kRefusedExit);
  if (done.is_heard) return kDoneExit;
  return ctl_failure(make_error(ErrorCode::Unavailable,
                                "this feed was not heard: no head motion arrives where hair is simulated"),
                     kRefusedExit);
}

}  // namespace

int run_feed(const CtlTarget& target, const FeedOptions& options, const std::atomic<bool>& stop) {
  // Files first: a typing error must not need a server to be found.
  auto plan = make_feed_plan(options, options.as.empty() ? [&] { return hair_of(target); } : FindHair());
  if (!plan) return ctl_failure(plan.error());
  if (options.is_checking) return tell_taken(*plan);
  if (!options.as.empty()) return run_mocap_feed(options, *plan, stop);
  if (options.rate_hz > kMaxFeedRateHz)
    return ctl_failure(make_error(ErrorCode::BadInput,
                                  "--rate {:g} is more than a server takes: {:g} at most", options.rate_hz,
                                  kMaxFeedRateHz));
  const bool has_limit = options.seconds > 0.0;
  const int64_t begin_ns = now_ns();
  const milliseconds limit =
      has_limit ? milliseconds(static_cast<int64_t>(options.seconds * 1e3)) : milliseconds::max();
  const auto config = speaking_config(target, Role::Source);
  const auto heads = config ? connect_heads(*config, stop, limit) : config.error();
  if (!heads) return ctl_failure(heads.error());
  // The wait for the server counts.
  const double waited_s = static_cast<double>(now_ns() - begin_ns) / kNsPerS;
  if (has_limit && waited_s > kLongWaitS)
    plan->duration_s = std::max(plan->duration_s - waited_s, kLeastFeedS);
  const std::vector<std::string>& names = heads->front()->welcome().heads;
  std::cerr << fmt::format("feeding {}{}: motion {}, wind {}, {} samples per second\n", target.connect,
                           heads->size() > 1 ? fmt::format(" ({})", fmt::join(names, ", ")) : "",
                           options.motion, options.wind, options.rate_hz)
            << timecode_line(options);
  const auto done = feed(*heads, *plan, stop, progress_listener());
  if (isatty(STDERR_FILENO) != 0) std::cerr << '\n';
  return done ? tell_fed(*done, plan->speed) : ctl_failure(done.error(), kRefusedExit);
}

int run_monitor(const CtlTarget& target, double seconds, const std::atomic<bool>& stop) {
  // A source gets status but no frames; whose token is not good for that watches.
  auto config = speaking_config(target, Role::Source);
  if (!config) config = speaking_config(target, Role::Viewer);
  if (!config) return ctl_failure(config.error());
  auto client = std::make_unique<SteadyClient>(*config);
  LineBudget lines;
  const auto print = [&lines](const std::string& line) {
    if (!lines.take(now_ns())) return;
    if (const uint64_t left_out = lines.take_left_out())
      std::cout << fmt::format("({} lines left out)\n", left_out);
    std::cout << line << std::endl;
  };
  const int64_t begin_ns = now_ns();
  const auto is_over = [&] {
    return seconds > 0.0 && static_cast<double>(now_ns() - begin_ns) * 1e-9 >= seconds;
  };
  bool was_slow = false;
  int64_t next_inputs_ns = 0;
  std::string told_detail;
  bool was_connected = false;
  bool has_been_there = false;
  while (!stop && std::cout && !is_over()) {
    const Status pumped = client->pump(milliseconds(100), [&](const ClientEvent& event) {
      if (const auto* status = std::get_if<ServerStatus>(&event)) {
        print(to_line(*status));
        // As often as a person reads.
        if (!status->live_inputs.empty() && now_ns() >= next_inputs_ns) {
          next_inputs_ns = now_ns() + kInputsIntervalNs;
          for (const LiveInputStatus& input : status->live_inputs)
            for (const std::string& text : to_lines(input)) print(one_line(text, kMaxInputLineChars));
        }
        const bool is_slow = !status->slow_motion.empty();
        if (is_slow && !std::exchange(was_slow, is_slow)) print(status->slow_motion);
        was_slow = is_slow;
        if (status->detail != told_detail)
          print("level of detail: " + (status->detail.empty() ? "full" : status->detail));
        told_detail = status->detail;
      }
      if (const auto* notice = std::get_if<Notice>(&event)) print(notice->text);
    });
    const bool has_joined = client->policy().standing() == Standing::Member;
    if (!pumped && pumped.error().code == ErrorCode::Unsupported && !has_joined &&
        config->hello.role == Role::Source) {
      config = speaking_config(target, Role::Viewer);
      if (!config) return ctl_failure(config.error());
      client = std::make_unique<SteadyClient>(*config);
      continue;
    }
    if (!pumped) return ctl_failure(pumped.error(), has_joined ? kRefusedExit : kBadInputExit);
    has_been_there = has_been_there || client->is_connected();
    if (std::exchange(was_connected, client->is_connected()) && !was_connected) print("not connected");
  }
  if (has_been_there || stop) return kDoneExit;
  return ctl_failure(make_error(ErrorCode::Unavailable, "{} did not answer in all the time", target.connect),
                     kRefusedExit);
}

namespace {

/// What a server answers with, beside notices.
using Answer = std::variant<SessionList, SceneText>;
/// Gives the exit code.
using TakeAnswer = std::function<int(const Answer&)>;

MessageMaker always(const ClientMessage& message) {
  return [message](const Welcome&) { return message; };
}

/// Sends one message and takes the answer; a notice is printed.
int ask(const CtlTarget& target, Role role, const MessageMaker& make, const TakeAnswer& take) {
  auto client = connect(target, role);
  if (!client) return ctl_failure(client.error());
  const auto message = make((*client)->welcome());
  if (!message) return ctl_failure(message.error());
  if (const auto sent = (*client)->send(*message); !sent) return ctl_failure(sent.error(), kRefusedExit);
  const int64_t begin_ns = now_ns();
  while (now_ns() - begin_ns < std::chrono::nanoseconds(kAnswerTimeout).count()) {
    if (const auto why = stopped(target)) return ctl_failure(*why, kRefusedExit);
    for (const ClientEvent& event : (*client)->wait(milliseconds(100))) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event))
        return ctl_failure(closed->error, kRefusedExit);
      if (const auto* list = std::get_if<SessionList>(&event)) return take(*list);
      if (const auto* scene = std::get_if<SceneText>(&event)) return take(*scene);
      const auto* notice = std::get_if<Notice>(&event);
      if (notice == nullptr) continue;
      (notice->is_error ? std::cerr : std::cout) << notice->text << '\n';
      return notice->is_error ? kRefusedExit : kDoneExit;
    }
  }
  return ctl_failure(
      make_error(ErrorCode::Timeout, "the server did not answer within {} ms", kAnswerTimeout.count()),
      kRefusedExit);
}

}  // namespace

int run_command(const CtlTarget& target, const MessageMaker& make) {
  return ask(target, Role::Controller, make, [](const Answer&) { return kDoneExit; });
}

int run_command(const CtlTarget& target, const ClientMessage& message) {
  return run_command(target, always(message));
}

int run_admin(const CtlTarget& target, const AdminCommand& command) {
  return ask(target, Role::Admin, always(command), [](const Answer& answer) {
    if (const auto* list = std::get_if<SessionList>(&answer)) std::cout << to_table(*list);
    return kDoneExit;
  });
}

int run_save(const CtlTarget& target, const std::filesystem::path& path) {
  return ask(target, Role::Controller, always(SceneRequest{}), [&](const Answer& answer) {
    const auto* text = std::get_if<SceneText>(&answer);
    if (text == nullptr) return kDoneExit;
    const auto scene = scene_of(*text);
    if (!scene) return ctl_failure(scene.error(), kRefusedExit);
    if (const auto saved = save_scene(path, to_text(*scene)); !saved) return ctl_failure(saved.error());
    std::cout << fmt::format("saved {}: strandcast-server --scene '{}'\n", path.string(), path.string());
    return kDoneExit;
  });
}

int run_check(const CtlTarget& target, uint64_t frames, double timeout_s) {
  auto config = client_config_for(target, Role::Viewer);
  if (!config) return ctl_failure(config.error());
  config->hello.step_ns = measured_step_ns();  // it decodes what viewers here get
  const auto check = check_stream(*config, frames, timeout_s);
  if (!check)
    return ctl_failure(check.error(),
                       check.error().code == ErrorCode::Timeout ? kRefusedExit : kBadInputExit);
  std::cout << check->to_string() << '\n';
  return check->is_good() ? kDoneExit : kRefusedExit;
}

int run_health(const CtlTarget& target) {
  const auto address = address_of(target);
  if (!address) return ctl_failure(address.error());
  const auto answer = http_get(*address, "/healthz", kHealthTimeout, {target.tls_authorities, {}});
  if (!answer) return ctl_failure(answer.error());
  constexpr unsigned kHttpOk = 200;
  if (answer->body.starts_with('<'))
    return ctl_failure(make_error(ErrorCode::BadInput,
                                  "{} answers with a web page: it is no Strandcast server", target.connect));
  print_lines(answer->body);
  return answer->status == kHttpOk ? kDoneExit : kRefusedExit;
}

}  // namespace strandcast
