#include "server/app/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <variant>

#include "common/base/command_line_error.h"
#include "common/base/timecode.h"
#include "common/base/version.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "server/app/live_manager.h"
#include "server/source/scene_change.h"

namespace strandcast {
namespace {

std::string version_text() {
  return fmt::format("strandcast-server {}", version());
}

constexpr double kMaxRunS = 1e9;
constexpr double kLeastExactRecordingS = 0.1;
constexpr double kMaxViewerMbit = 1e6;
constexpr uint32_t kMaxExplainedViewers = 10'000;

/// A number from `low` to `high`. CLI::Range lets NaN pass.
CLI::Validator in_range(double low, double high) {
  const std::string range = fmt::format("{}..{}", low, high);
  return CLI::Validator(
      [low, high, range](const std::string& text) {
        double value = 0.0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        return is_number && value >= low && value <= high ? std::string() : text + " is not within " + range;
      },
      range);
}

/// A limit that may be set, and how far.
struct LimitRow {
  const char* option;
  std::variant<uint32_t NetLimits::*, int64_t NetLimits::*, double NetLimits::*> limit;
  double low, high;
  const char* help;
};

const LimitRow kLimitRows[] = {
    {"--max-sessions", &NetLimits::sessions, 1, kMaxSessions, "sessions at once"},
    {"--max-sessions-per-address", &NetLimits::sessions_per_address, 1, kMaxSessions,
     "sessions of one address (of IPv6: one /64) at once"},
    {"--connections-per-s", &NetLimits::connections_per_s, 1, 10'000,
     "new connections of one address a second, and as many at once; not on trusted loopback"},
    {"--messages-per-s", &NetLimits::messages_per_s, 10, 10'000,
     "messages of one session a second, and as many at once"},
    {"--wrong-tokens", &NetLimits::wrong_tokens, 0, 1'000,
     "wrong tokens of one address that are forgiven within the window"},
    {"--wrong-token-window-ms", &NetLimits::wrong_token_window_ms, 1'000, 86'400'000,
     "how long a wrong token is remembered"},
    {"--wrong-token-block-ms", &NetLimits::wrong_token_block_ms, 1'000, 86'400'000,
     "how long no token of an address is looked at after one wrong one too many"},
    {"--handshake-ms", &NetLimits::handshake_ms, 100, 60'000, "time from the connection to the Hello"},
    {"--idle-ms", &NetLimits::idle_ms, 1'000, 600'000, "silence, our pings unanswered, that ends a session"},
    {"--stalled-ms", &NetLimits::stalled_ms, 500, 60'000,
     "a viewer that takes or answers nothing for so long is dropped"}};

void add_limit_options(CLI::App& app, NetLimits& limits) {
  for (const LimitRow& row : kLimitRows)
    std::visit(
        [&](auto limit) {
          app.add_option(row.option, limits.*limit, row.help)
              ->check(in_range(row.low, row.high))
              ->capture_default_str()
              ->group("Limits");
        },
        row.limit);
}

/// Sets the files of a groom; "a.tfx,b.tfx" names two, unless one file has that name.
std::vector<std::string> groom_overrides(const std::vector<std::string>& given) {
  std::vector<std::string> files;
  for (const std::string& names : given) {
    if (std::filesystem::exists(names)) {
      files.push_back(names);
      continue;
    }
    for (size_t begin = 0; begin <= names.size();) {
      const size_t end = std::min(names.find(',', begin), names.size());
      files.push_back(names.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  std::vector<std::string> overrides = {fmt::format("groom.file.path={}", files.front())};
  for (size_t i = 1; i < files.size(); ++i)
    overrides.push_back(fmt::format("groom.file.more_paths.{}={}", i - 1, files[i]));
  return overrides;
}

/// Files and scenes that options name besides the scene itself.
struct NamedFiles {
  std::vector<std::string> grooms;
  std::string checked;
  std::string explained;
};

void add_scene_options(CLI::App& app, ServerOptions& options, NamedFiles& named) {
  app.add_option("--scene", options.scene_path, "scene file (protobuf text); default: the built-in scene");
  app.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  app.add_option("--groom", named.grooms,
                 "hair from this .tfx, .hair, .ply, .usd or .abc file; hair in several files: FILE,FILE or "
                 "the option repeated")
      ->expected(1)
      ->take_all();
  app.add_option("--check", named.checked,
                 "hair file as for --groom: draw it as loaded, from four sides, take a few steps, say what "
                 "was guessed, "
                 "and leave; without a file: the hair of the scene")
      ->expected(0, 1);
  app.add_option("--out", options.check_folder, "folder for what --check leaves: groom.png and groom.txt")
      ->capture_default_str();
  app.add_flag("--list-solvers", options.is_listing_solvers,
               "print the solvers and their parameters, and leave");
  app.add_option("--explain", named.explained, "print what runs for the scene and why, and leave")
      ->expected(0, 1);
  app.add_option("--frame-viewers", options.explained_frame_viewers,
                 "with --explain: assume so many frame viewers")
      ->check(in_range(0, kMaxExplainedViewers));
  app.add_flag("--print-scene", options.is_printing_scene, "print the scene with its overrides, and leave");
}

/// What needs more than a value to be stored.
struct RawRunOptions {
  std::string shader_folder;
  double viewer_mbit = 0.0;
  bool is_loopback_distrusted = false;
  TlsFiles tls;
  bool is_tls_only = false;
  std::vector<std::string> trusted_proxies;
  bool has_proxy_protocol = false;
  std::vector<std::string> mocap_allowed;
  std::vector<std::string> sends;
  std::string record_path;
  std::string record_folder;
  bool replaces_recording = false;
  double exact_recording_s = 0.0;
  bool is_replayed_in_real_time = false;
  std::string log_format = "text";
  std::string upstream;
  UpstreamOptions of_upstream;
};

/// What a relay leaves to the server that it stands in for.
constexpr const char* kNotForRelays[] = {
    "--scene",      "--set",   "--groom",    "--check",    "--list-solvers",  "--explain",  "--print-scene",
    "--mocap",      "--send",  "--record",   "--replay",   "--sim-device",    "--renderer", "--gl-device",
    "--shader-dir", "--trace", "--lockstep", "--timecode", "--timecode-clock"};

void add_relay_options(CLI::App& app, RawRunOptions& raw) {
  constexpr const char* kGroup = "Relay";
  auto* upstream =
      app.add_option("--upstream", raw.upstream,
                     "pass on the stream of this server, or relay, and simulate nothing: HOST:PORT, with "
                     "wss:// in front for TLS");
  upstream->group(kGroup);
  const auto add = [&](const char* name, auto& value, const char* help) {
    app.add_option(name, value, help)->needs(upstream)->group(kGroup);
  };
  add("--upstream-token-file", raw.of_upstream.token_path,
      "file with the token that this relay gives there: the token alone, or lines 'role token'");
  add("--upstream-tls-ca", raw.of_upstream.tls_authorities,
      "certificates (PEM) to trust there; default: the system's");
  add("--upstream-head", raw.of_upstream.head,
      "pass on this head alone, by its name; default: all that are there");
}

Result<std::optional<UpstreamOptions>> upstream_of(const CLI::App& app, const RawRunOptions& raw) {
  if (raw.upstream.empty()) return std::optional<UpstreamOptions>();
  std::string wrong;
  for (const char* name : kNotForRelays)
    if (app.count(name) > 0) wrong += fmt::format("{}{}", wrong.empty() ? "" : ", ", name);
  if (!wrong.empty())
    return make_error(ErrorCode::BadInput,
                      "--upstream passes on what another server simulates: leave out {}, or give it there",
                      wrong);
  UpstreamOptions upstream = raw.of_upstream;
  const auto address = parse_address(raw.upstream);
  if (!address) return at("--upstream", address.error());
  upstream.address = *address;
  return std::optional(upstream);
}

void add_mocap_options(CLI::App& app, ServerOptions& options, RawRunOptions& raw) {
  constexpr const char* kGroup = "Live motion capture";
  std::string protocols;
  for (const LiveProtocol& protocol : live_protocols())
    protocols += fmt::format("{}{}", protocols.empty() ? "" : ", ", protocol.name);
  auto* inputs =
      app.add_option("--mocap", options.mocap.inputs,
                     "head motion as a stage sends it, instead of the scene's live inputs: PROTOCOL, "
                     "PROTOCOL:PORT or PROTOCOL://HOST (" +
                         protocols + "); repeatable");
  inputs->expected(1)->take_all()->group(kGroup);
  app.add_option("--mocap-subject", options.mocap.subject,
                 "who of those that it tells of drives the head; default: one called head, else the first")
      ->needs(inputs)
      ->group(kGroup);
  app.add_option(
         "--mocap-axes", options.mocap.axes,
         "how its numbers are meant, where senders disagree; a wrong name is answered with those there are")
      ->needs(inputs)
      ->group(kGroup);
  app.add_option(
         "--mocap-timecode", options.mocap.timecode,
         "freed: its spare word counts frames of timecode, so many a second: 25, 29.97df; or bits of it "
         "do: 25:12-15")
      ->needs(inputs)
      ->group(kGroup);
  app.add_option(
         "--mocap-scale", options.mocap.scale,
         "its places times this, for senders of another unit or size: 0.01 makes metres of centimetres")
      ->check(in_range(kMinLiveScale, kMaxLiveScale))
      ->capture_default_str()
      ->needs(inputs)
      ->group(kGroup);
  app.add_option("--mocap-allow", raw.mocap_allowed,
                 "ADDRESS or ADDRESS/BITS that may send besides this machine; repeatable")
      ->expected(1)
      ->take_all()
      ->group(kGroup);
  app.add_option("--send", raw.sends,
                 "send the head to who follows it, with every step: PROTOCOL, PROTOCOL:PORT or "
                 "PROTOCOL://HOST (" +
                     mocap_encoding_names() + "); repeatable")
      ->expected(1)
      ->take_all()
      ->group(kGroup);
}

void add_record_options(CLI::App& app, ServerOptions& options, RawRunOptions& raw) {
  auto* path =
      app.add_option("--record", raw.record_path,
                     "record inputs, states and strands into this MCAP file, a new one; several heads: each "
                     "into its own, run.mcap and for a head ben run-ben.mcap");
  app.add_flag("--record-replace", raw.replaces_recording, "the file of --record may be there: replace it")
      ->needs(path);
  app.add_option("--record-exact", raw.exact_recording_s,
                 "in lockstep: hair goes on from what keyframes of the recording tell, and a keyframe comes "
                 "after so many seconds")
      ->check(in_range(kLeastExactRecordingS, kMaxRunS))
      ->needs(path)
      ->needs(app.get_option("--lockstep"));
  auto* folder = app.add_option(
      "--record-dir", raw.record_folder,
      "who controls may begin and end recordings in this folder, made if need be (strandcast-ctl "
      "record start NAME, record stop), of each head one at a time");
  auto* replay =
      app.add_option("--replay", options.replay_path,
                     "simulate this recording again, compare the hash of every state, and leave: exit "
                     "code 0 when all are equal, 1 when not");
  replay->excludes(path)->excludes(folder);
  app.add_flag("--replay-realtime", raw.is_replayed_in_real_time,
               "with --replay: no faster than it was recorded")
      ->needs(replay);
}

void add_proxy_options(CLI::App& app, RawRunOptions& raw) {
  auto* proxies = app.add_option("--trusted-proxy", raw.trusted_proxies,
                                 "ADDRESS or ADDRESS/BITS of a proxy that may say for whom it connects, in "
                                 "X-Forwarded-For or a PROXY header; repeatable");
  proxies->expected(1)->take_all();
  app.add_flag("--proxy-protocol", raw.has_proxy_protocol,
               "trusted proxies begin each connection with a PROXY header of version 2")
      ->needs(proxies);
}

void add_run_options(CLI::App& app, ServerOptions& options, RawRunOptions& raw) {
  NetConfig& net = options.config.net;
  app.add_option("--listen", net.address, "address to listen on; beyond loopback a token is needed")
      ->capture_default_str();
  app.add_option("--port", net.port, "TCP port, 0 = any free one")->capture_default_str();
  app.add_option("--port-file", options.port_path, "write the port to this file once the server is ready");
  app.add_option(
      "--token-file", options.token_path,
      "tokens that clients must give, one line 'role token' for each of viewer, controller, source, admin; "
      "made and shown once when there is no such file");
  app.add_flag("--distrust-loopback", raw.is_loopback_distrusted,
               "treat connections from this machine like all others: behind a proxy or tunnel");
  app.add_option("--allow-host", net.allowed_hosts, "further name accepted in the Host header; repeatable")
      ->expected(1)
      ->take_all();
  app.add_option("--allow-origin", net.allowed_origins,
                 "further web origin that may connect, exactly (https://HOST:PORT); repeatable")
      ->expected(1)
      ->take_all();
  auto* certificate =
      app.add_option("--tls-cert", raw.tls.certificate, "certificate (PEM) for TLS, with its chain");
  auto* key = app.add_option("--tls-key", raw.tls.key, "key (PEM) of the certificate");
  certificate->needs(key);
  key->needs(certificate);
  app.add_flag("--tls-only", raw.is_tls_only, "refuse connections without TLS on loopback too")
      ->needs(certificate);
  app.add_option("--viewer-mbit", raw.viewer_mbit,
                 "most that the strands for one viewer may take, Mbit/s; 0 = no cap")
      ->check(in_range(0.0, kMaxViewerMbit));
  app.add_option(
         "--sim-device", options.config.sim_device,
         "what simulates: lanes (the processors, without OpenGL), gl, or auto: gl where the device is "
         "hardware or named")
      ->check(CLI::IsMember({"auto", "gl", "lanes"}))
      ->capture_default_str();
  app.add_option("--renderer", options.config.renderer,
                 "what draws pictures: tiles (the processor), gl, or auto: gl where the device is hardware")
      ->check(CLI::IsMember({"auto", "tiles", "gl"}))
      ->capture_default_str();
  app.add_option("--gl-device", options.config.gl_device, "auto, software, hardware or a device number")
      ->capture_default_str();
  app.add_option("--shader-dir", raw.shader_folder, "read shaders from this folder instead of the program");
  app.add_option("--log-level", options.log_level, "debug, info, warn, error or off")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_option("--log-format", raw.log_format,
                 "text, or json: one object a line, with time, level, tag and message")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_option(
      "--trace", options.config.trace_path,
      "write a line per state to this file, of further heads to states-ben.csv and the like: when its motion "
      "came, when it was published and encoded");
  app.add_option_function<std::string>(
      "--timecode",
      [&options](const std::string& text) {
        const auto count = parse_timecode_count(text);
        if (!count) throw CLI::ValidationError("--timecode", count.error().message);
        options.config.timecode = *count;
      },
      "frames per second of a timecode by this machine's clock, where nobody sends one: 24, 23.976, 29.97df");
  app.add_option_function<std::string>(
      "--timecode-clock",
      [&options](const std::string& text) {
        const auto clock = StageClock::open(text);
        if (!clock) throw CLI::ValidationError("--timecode-clock", clock.error().message);
        options.config.clock = *clock;
      },
      "which clock that is, and that of --send opentrackio: local (first; it jumps with summer time), utc, "
      "tai (what "
      "PTP counts), or a PTP device such as /dev/ptp0");
  app.add_flag("--lockstep", options.config.is_lockstep,
               "simulated time goes on by strandcast-ctl step N only, and inputs are for simulated times");
  app.add_option("--seconds", options.run_s, "stop after so many seconds")->check(in_range(0.0, kMaxRunS));
  add_proxy_options(app, raw);
  add_mocap_options(app, options, raw);
  add_record_options(app, options, raw);
  add_relay_options(app, raw);
  add_limit_options(app, net.limits);
}

/// What a browser says of where a page comes from: anything else lets nobody in.
Status check_origins(const std::vector<std::string>& origins) {
  for (const std::string& origin : origins) {
    const size_t scheme = origin.find("://");
    const std::string host = scheme == std::string::npos ? "" : origin.substr(scheme + 3);
    if (host.empty() || host.find_first_of("/?#@ ") != std::string::npos)
      return make_error(
          ErrorCode::BadInput,
          "--allow-origin {} is no web origin: https://HOST or https://HOST:PORT is one, without "
          "a path",
          origin);
  }
  return {};
}

Status check_once(const char* option, std::vector<std::string> values) {
  std::sort(values.begin(), values.end());
  const auto twice = std::adjacent_find(values.begin(), values.end());
  if (twice == values.end()) return {};
  return make_error(ErrorCode::BadInput, "{} {} is given twice", option, *twice);
}

}  // namespace

Result<ServerOptions> parse_options(int argc, const char* const* argv) {
  ServerOptions options;
  NamedFiles named;
  RawRunOptions raw;
  CLI::App app("Simulates hair and streams it to viewers.", "strandcast-server");
  app.set_version_flag("--version", version_text());
  add_scene_options(app, options, named);
  add_run_options(app, options, raw);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    options.help = app.help();
  } catch (const CLI::CallForVersion&) {
    options.help = version_text() + "\n";
  } catch (const CLI::ParseError& error) {
    return make_error(ErrorCode::BadInput, "{} (--help lists the options)", command_line_error(error.what()));
  }
  RETURN_IF_ERROR(check_origins(options.config.net.allowed_origins));
  RETURN_IF_ERROR(check_once("--mocap", options.mocap.inputs));
  constexpr double kBytesPerMbit = 125e3;
  options.config.net.limits.viewer_bytes_per_s = raw.viewer_mbit * kBytesPerMbit;
  if (!raw.tls.certificate.empty()) options.config.net.tls = raw.tls;
  if (raw.is_tls_only) options.config.net.plain_access = PlainAccess::Nobody;
  if (raw.is_loopback_distrusted) options.config.net.loopback_trust = LoopbackTrust::LikeAllOthers;
  for (const std::string& text : raw.trusted_proxies) {
    ASSIGN_OR_RETURN(const AddressRange range, parse_address_range(text));
    options.config.net.trusted_proxies.push_back(range);
  }
  for (const std::string& text : raw.mocap_allowed) {
    const auto range = parse_address_range(text);
    if (!range) return at("--mocap-allow", range.error());
    options.config.live_allowed.push_back(*range);
  }
  for (const std::string& text : raw.sends) {
    ASSIGN_OR_RETURN(HeadSend send, parse_head_send(text));
    options.config.sends.push_back(std::move(send));
  }
  ASSIGN_OR_RETURN(options.upstream, upstream_of(app, raw));
  if (raw.has_proxy_protocol) options.config.net.proxy_protocol = ProxyProtocol::Version2;
  if (!raw.record_path.empty())
    options.config.record =
        RecordConfig{raw.record_path, raw.replaces_recording ? IfPresent::Replace : IfPresent::Refuse,
                     raw.exact_recording_s};
  if (!raw.record_folder.empty()) options.config.record_folder = RecordFolder{raw.record_folder};
  if (raw.is_replayed_in_real_time) options.replay_pace = ReplayPace::RealTime;
  if (!options.replay_path.empty() && app.count("--scene") + app.count("--set") + app.count("--groom") > 0)
    return make_error(
        ErrorCode::BadInput,
        "--replay takes scene and hair from the recording: leave out --scene, --set and --groom");
  options.has_json_log = raw.log_format == "json";
  options.is_explaining = app.count("--explain") > 0;
  if (!named.explained.empty()) {
    if (!options.scene_path.empty())
      return make_error(ErrorCode::BadInput, "give the scene once: --explain {} or --scene {}",
                        named.explained, options.scene_path.string());
    options.scene_path = named.explained;
  }
  options.is_checking = app.count("--check") > 0;
  if (app.count("--out") > 0 && !options.is_checking)
    return make_error(ErrorCode::BadInput, "--out is the folder of --check, which is missing");
  if (!named.checked.empty()) named.grooms.insert(named.grooms.begin(), named.checked);
  // First, so that --set can still change what belongs to the file (its unit, its axes).
  if (!named.grooms.empty()) {
    std::vector<std::string> first = groom_overrides(named.grooms);
    // A groom without a scene of its own brings no head: the built-in one is made to fit under it.
    if (options.scene_path.empty()) first.push_back("head.radius_m=0");
    options.overrides.insert(options.overrides.begin(), first.begin(), first.end());
  }
  if (!raw.shader_folder.empty()) options.config.shader_folder = raw.shader_folder;
  return options;
}

Result<ServerConfig> load_config(const ServerOptions& options) {
  const auto load = [&](const std::vector<std::string>& overrides) {
    if (!options.scene_path.empty()) return load_scene(options.scene_path, overrides);
    std::vector<std::string> all = {std::string("quality=") + kAutoQuality};
    all.insert(all.end(), overrides.begin(), overrides.end());
    return built_in_scene_with(all);
  };
  ServerConfig config = options.config;
  // What is set of live inputs is set of those that the command line names.
  std::vector<std::string> overrides = options.overrides, live_overrides;
  if (!options.mocap.inputs.empty()) {
    std::copy_if(overrides.begin(), overrides.end(), std::back_inserter(live_overrides), is_live_override);
    std::erase_if(overrides, is_live_override);
  }
  ASSIGN_OR_RETURN(const SceneDesc loaded, load(overrides));
  ASSIGN_OR_RETURN(const SceneDesc scene, with_mocap(loaded, options.mocap, live_overrides));
  RETURN_IF_ERROR(check_live(scene.live));
  std::vector<std::string> others = overrides;
  std::erase_if(others, [](const std::string& assignment) { return assignment.starts_with("solver"); });
  ASSIGN_OR_RETURN(const SceneDesc own, load(others));
  ASSIGN_OR_RETURN(config.scene, choose_solver(scene, own.solver, options.overrides));
  for (size_t i = 0; i < config.scene.heads.size(); ++i) {
    RETURN_IF_ERROR(check_live(scene.heads[i].live));
    ASSIGN_OR_RETURN(config.scene.heads[i],
                     choose_solver(scene.heads[i], own.heads[i].solver, options.overrides));
  }
  RETURN_IF_ERROR(check_sends(config.sends, scene));
  if (const std::string note = left_out_note(scene, config.scene); !note.empty()) log_warn("app", "{}", note);
  return config;
}

}  // namespace strandcast
