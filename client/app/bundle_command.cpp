#include "client/app/bundle_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <iostream>
#include <span>
#include <utility>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/app/scenario/server_process.h"
#include "common/base/base64.h"
#include "common/base/command_line_error.h"
#include "common/base/file.h"
#include "common/base/units.h"
#include "common/scene/scene_file.h"
#include "common/wire/messages.h"

namespace strandcast {
namespace {

constexpr double kMostBundleSeconds = 3'600.0;

/// Unpacks the parts and starts the page's script. Modules and script become files of this document alone.
constexpr std::string_view kLoader = R"html(<script>
addEventListener('DOMContentLoaded', async () => {
  const bytes = (id) => {
    const text = atob(document.getElementById(id).textContent);
    const all = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) all[i] = text.charCodeAt(i);
    return all;
  };
  // 4 bytes as 5 digits (text_of_85).
  const value = new Uint8Array(128);
  for (let code = 35, i = 0; code < 126; ++code)
    if (!"&'<>\\`".includes(String.fromCharCode(code))) value[code] = i++;
  const bytesOf85 = (id) => {
    const text = document.getElementById(id).textContent;
    const all = new Uint8Array(Math.floor((text.length * 4) / 5));
    for (let at = 0, out = 0; at < text.length; at += 5, out += 4) {
      let group = 0;
      for (let i = 0; i < 5; ++i) group = group * 85 + (at + i < text.length ? value[text.charCodeAt(at + i)] : 84);
      for (let i = 0; i < 4 && out + i < all.length; ++i) all[out + i] = Math.floor(group / 2 ** (24 - 8 * i));
    }
    return all;
  };
  const unzipped = async (id, type) => {
    const stream = new Blob([bytesOf85(id)]).stream().pipeThrough(new DecompressionStream('gzip'));
    return new Blob([await new Response(stream).arrayBuffer()], { type });
  };
  if (!document.getElementById('end')) {
    const sentence = document.createElement('p');
    sentence.textContent = 'This file was cut off on its way, and cannot be shown: copy it again.';
    document.body.replaceChildren(sentence);
    return;
  }
  // As an address that workers of a file may fetch, too.
  const module = async (id) => {
    if (!document.getElementById(id)) return '';
    const reader = new FileReader();
    reader.readAsDataURL(await unzipped(id, 'application/wasm'));
    await new Promise((done) => (reader.onload = done));
    return reader.result;
  };
  const assets = { core: await module('core'), stepCore: await module('stepCore'), wholeCore: '' };
  document.querySelector('meta[name=strandcast-assets]').content = JSON.stringify(assets);
  const script = URL.createObjectURL(await unzipped('script', 'text/javascript'));
  globalThis.strandcastBundle = { tape: bytes('tape').buffer, codec: document.getElementById('tape').dataset.codec, script };
  await import(script);
});
</script>
)html";

std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// What client/web/page/tape.ts reads: the number of messages before the first frame, then of each message
/// its time in ms and its size, little-endian, and its bytes.
class Tape {
 public:
  explicit Tape(uint32_t first_count) { put(first_count); }
  void add(uint32_t time_ms, std::span<const std::byte> message) {
    put(time_ms);
    put(static_cast<uint32_t>(message.size()));
    bytes_ += as_text(message);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void put(uint32_t value) {
    static_assert(std::endian::native == std::endian::little);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  std::string bytes_;
};

Welcome welcome_of(const RecordingStart& start, const SceneDesc& scene, const SceneAsset& asset) {
  Welcome welcome;
  welcome.session_id = "0000000000000000";
  welcome.server_version = start.server_version;
  welcome.scene_name = scene.name;
  welcome.mode_reason = "a recording is played";
  welcome.codec = start.codec;
  welcome.codec_reason = "as recorded";
  welcome.strand_count = asset.strand_count;
  welcome.vertex_count = asset.vertex_count;
  welcome.bound_m = scene.stream.bound_m;
  welcome.step_rate_hz = scene.step_rate_hz;
  welcome.sim_device = start.sim_device_name;
  welcome.look = scene.look;
  welcome.camera = scene.camera;
  welcome.frame_width = scene.stream.frame_width;
  welcome.frame_height = scene.stream.frame_height;
  return welcome;
}

/// Every 4 bytes as 5 digits of what stands in HTML as it is: a sixteenth less than base64. n bytes at the
/// end take n + 1.
std::string text_of_85(std::string_view bytes) {
  static const std::string kDigits = [] {
    std::string digits;
    for (char code = '#'; code < '~'; ++code)
      if (std::string_view("&'<>\\`").find(code) == std::string_view::npos) digits += code;
    return digits;
  }();
  std::string text;
  for (size_t at = 0; at < bytes.size(); at += 4) {
    uint32_t group = 0;
    for (size_t i = at; i < at + 4; ++i)
      group = group << 8 | (i < bytes.size() ? static_cast<uint8_t>(bytes[i]) : 0u);
    std::array<char, 5> five;
    for (size_t i = five.size(); i-- > 0; group /= 85) five[i] = kDigits[group % 85];
    text.append(five.data(), std::min<size_t>(bytes.size() - at, 4) + 1);
  }
  return text;
}

std::string script_of(std::string_view id, const std::string& text, std::string_view attributes = {}) {
  return fmt::format("<script type=\"application/octet-stream\" id=\"{}\"{}>{}</script>\n", id, attributes,
                     text);
}

/// Returns the file whose path begins with "/" and this name.
Result<const PageFile*> part(PageFiles files, std::string_view name) {
  const auto found = std::find_if(files.begin(), files.end(), [&](const PageFile& file) {
    return file.path.substr(std::min<size_t>(1, file.path.size())).starts_with(name);
  });
  if (found == files.end()) return make_error(ErrorCode::Unsupported, "this build's page has no {}", name);
  return &*found;
}

/// Replaces the line of the index that holds `what`.
Status replace_line(std::string& html, std::string_view what, std::string_view by) {
  const size_t at = html.find(what);
  if (at == std::string::npos) return make_error(ErrorCode::Unsupported, "the page has no {}", what);
  const size_t begin = html.rfind('\n', at) + 1;
  const size_t end = html.find('\n', at);
  html.replace(begin, end - begin, by);
  return {};
}

Error no_page() {
  return make_error(
      ErrorCode::Unsupported,
      "this build has no page for browsers (build with -DSTRANDCAST_WEB=ON, as deploy/run.sh --web does)");
}

Result<std::string> page_with(PageFiles files, const std::string& tape, const std::string& codec,
                              bool has_all_solvers) {
  const auto index =
      std::find_if(files.begin(), files.end(), [](const auto& file) { return file.path == "/"; });
  if (index == files.end()) return no_page();
  std::string html(index->plain);
  ASSIGN_OR_RETURN(const PageFile* style, part(files, "style."));
  ASSIGN_OR_RETURN(const PageFile* script, part(files, "main."));
  ASSIGN_OR_RETURN(const PageFile* core, part(files, "strand_page."));
  RETURN_IF_ERROR(replace_line(html, "rel=\"stylesheet\"", fmt::format("<style>{}</style>", style->plain)));
  RETURN_IF_ERROR(replace_line(html, "rel=\"preload\"", ""));
  std::string parts(kLoader);
  parts += script_of("script", text_of_85(script->gzip));
  parts += script_of("core", text_of_85(core->gzip));
  if (codec != "tangent") {
    ASSIGN_OR_RETURN(const PageFile* step, part(files, has_all_solvers ? "strand_core." : "strand_step."));
    parts += script_of("stepCore", text_of_85(step->gzip));
  }
  parts +=
      script_of("tape", base64_of(std::as_bytes(std::span(tape))), fmt::format(" data-codec=\"{}\"", codec));
  parts += script_of("end", "");  // missing where the file was cut off
  RETURN_IF_ERROR(replace_line(html, "<script type=\"module\"", parts));
  return html;
}

uint32_t time_ms(int64_t since_ns) {
  return static_cast<uint32_t>(std::clamp<int64_t>(since_ns, 0, int64_t{3'600} * kSInNs) / kMsInNs);
}

/// Puts frames onto the tape, and looks where they change.
class TapeMaker {
 public:
  TapeMaker(Tape& tape, Bundle& bundle, LookChange look, std::string codec, std::optional<double> seconds)
      : tape_(tape),
        bundle_(bundle),
        look_(encode(ServerMessage(std::move(look)))),
        codec_(std::move(codec)),
        most_s_(seconds.value_or(kMostBundleSeconds)) {}

  /// LimitExceeded beyond kMaxBundleTapeBytes.
  Status take_all(RecordingReader& reader) {
    uint32_t damaged_in_a_row = 0;
    while (damaged_in_a_row < kMostDamagedInARow) {
      const auto item = reader.next();
      damaged_in_a_row = item ? 0 : damaged_in_a_row + 1;
      if (!item) {
        ++bundle_.damaged;
        continue;
      }
      if (!*item || !take((*item)->what)) break;
      if (tape_.bytes().size() > kMaxBundleTapeBytes)
        return make_error(ErrorCode::LimitExceeded,
                          "{:.1f} s of this recording take more than {} MiB: --seconds", bundle_.seconds,
                          kMaxBundleTapeBytes >> 20);
    }
    return {};
  }

 private:
  /// Returns whether there is more to take.
  bool take(const std::variant<RecordedFrame, RecordedMessage>& what) {
    if (const auto* frame = std::get_if<RecordedFrame>(&what)) return take(*frame);
    const auto& message = std::get<RecordedMessage>(what);
    if (const auto* look = std::get_if<LookChange>(&message)) look_ = encode(ServerMessage(*look));
    const auto* stream = std::get_if<RecordedStream>(&message);
    if (stream == nullptr || stream->codec == codec_) return true;
    bundle_.other_codec = stream->codec;
    return false;
  }
  bool take(const RecordedFrame& frame) {
    if (!first_ns_ && !frame.is_keyframe()) return true;
    const int64_t now_ns = frame.frame->header.sim_time_ns;
    if (!first_ns_) first_ns_ = now_ns;
    const double now_s = static_cast<double>(now_ns - *first_ns_) / kNsPerS;
    if (now_s > most_s_) return false;
    bundle_.seconds = now_s;
    const uint32_t now_ms = time_ms(now_ns - *first_ns_);
    if (look_ != told_look_) tape_.add(now_ms, look_);
    told_look_ = look_;
    tape_.add(now_ms, frame.frame->message);
    ++bundle_.frame_count;
    return true;
  }

  Tape& tape_;
  Bundle& bundle_;
  std::vector<std::byte> look_, told_look_;  // messages
  const std::string codec_;
  const double most_s_;
  std::optional<int64_t> first_ns_;
};

int bundle_recording(const std::filesystem::path& recording, const BundleCommand& command) {
  const auto reader = RecordingReader::open(recording);
  if (!reader) return ctl_failure(reader.error());
  const auto bundle = make_bundle(**reader, built_in_page(), command);
  if (!bundle) return ctl_failure(bundle.error());
  const std::filesystem::path& page = command.paths.back();
  if (const Status saved = save_file(page, std::as_bytes(std::span(bundle->html))); !saved)
    return ctl_failure(saved.error());
  constexpr double kBytesPerKb = 1e3;
  std::cout << fmt::format("{}: {} frames, {:.1f} s; {:.0f} kB, {:.0f} kB of them the recording's\n",
                           page.string(), bundle->frame_count, bundle->seconds,
                           static_cast<double>(bundle->html.size()) / kBytesPerKb,
                           static_cast<double>(bundle->tape_bytes) * 4.0 / 3.0 / kBytesPerKb);
  if (!(*reader)->info().is_indexed)
    std::cout << "  the recording was cut off, or is still being written: what is missing at its end is "
                 "missing here\n";
  if (bundle->damaged > 0)
    std::cout << fmt::format("  {} damaged parts of the recording are left out\n", bundle->damaged);
  if (!bundle->other_codec.empty())
    std::cout << fmt::format("  the recording goes on by the codec {}, which is left out\n",
                             bundle->other_codec);
  return kDoneExit;
}

}  // namespace

void declare_bundle(CLI::App& app, BundleCommand& command) {
  SceneRecordingOptions& scene = command.scene;
  app.add_option("paths", command.paths,
                 "[RECORDING.mcap, SCENE.textproto or a hair file] OUT.html (default: the built-in scene); "
                 "OUT.html is replaced")
      ->required()
      ->expected(1, 2);
  app.add_option("--seconds", command.seconds,
                 "Length from the begin of the recording (default: all of it), or of the scene (default: 10)")
      ->check(without_nan(CLI::Range(0.0, kMostBundleSeconds)));
  app.add_flag("--all-solvers", command.has_all_solvers,
               "Take the larger module that steps every solver, as for a recording whose solver changes");
  app.add_option("--motion", scene.motion, "Of a scene: BVH file, builtin, still or none")
      ->capture_default_str();
  app.add_option("--wind", scene.wind, "Of a scene: CSV file, gusts or none")->capture_default_str();
  app.add_option("--set", scene.overrides, "Of a scene: a parameter as path=value; repeatable")
      ->expected(1)
      ->take_all();
  app.add_option("--server", scene.server,
                 "Server program that simulates a scene (default: strandcast-server beside this one)");
}

Result<Bundle> make_bundle(RecordingReader& reader, PageFiles files, const BundleCommand& command) {
  const RecordingStart& start = reader.start();
  ASSIGN_OR_RETURN(const SceneAsset asset, reader.asset());
  ASSIGN_OR_RETURN(const SceneDesc scene, parse_scene(start.scene_text, "the recording's scene", {}));
  Bundle bundle;
  constexpr uint32_t kFirstCount = 2;
  Tape tape(kFirstCount);
  tape.add(0, encode(ServerMessage(welcome_of(start, scene, asset))));
  tape.add(0, reader.asset_frame()->message);
  RETURN_IF_ERROR(
      TapeMaker(tape, bundle, {scene.look, scene.camera}, start.codec, command.seconds).take_all(reader));
  if (bundle.frame_count == 0)
    return make_error(ErrorCode::BadInput, "the recording has no frame to begin with");
  bundle.tape_bytes = tape.bytes().size();
  const bool is_usual = scene.solver.name == "dftl" || scene.solver.name == "direct_rod";
  ASSIGN_OR_RETURN(bundle.html,
                   page_with(files, tape.bytes(), start.codec, command.has_all_solvers || !is_usual));
  return bundle;
}

int run_bundle(const BundleCommand& command, const std::atomic<bool>& stop) {
  if (const std::filesystem::path& page = command.paths.back(); page.extension() != ".html")
    return ctl_failure(
        make_error(ErrorCode::BadInput, "a bundle is a file OUT.html, and {} is none", page.string()));
  const std::filesystem::path source = command.paths.size() > 1 ? command.paths.front() : "";
  if (source.extension() == ".mcap") return bundle_recording(source, command);
  if (built_in_page().empty()) return ctl_failure(no_page());
  const auto folder = make_temporary_folder();
  if (!folder) return ctl_failure(folder.error());
  const std::filesystem::path recording = *folder / "scene.mcap";
  SceneRecordingOptions options = command.scene;
  options.scene = source;
  options.seconds = command.seconds.value_or(options.seconds);
  const Status recorded = record_scene(options, recording, stop);
  const int code = recorded ? bundle_recording(recording, command) : ctl_failure(recorded.error());
  std::error_code ignored;
  std::filesystem::remove_all(*folder, ignored);
  return code;
}

}  // namespace strandcast
