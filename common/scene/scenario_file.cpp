#include "common/scene/scenario_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string_view>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/text.h"
#include "common/scene/scene_fields.h"
#include "common/scene/text_errors_private.h"
#include "strandcast/v1/scenario.pb.h"

namespace strandcast {
namespace {

namespace pb = google::protobuf;
using scene_fields::Range;

constexpr int kMaxScenarioNesting = 8;
constexpr size_t kMaxWordBytes = 64;
constexpr size_t kMaxTextBytes = 4'096;  // an assignment may set a whole group
constexpr uint32_t kMaxSteps = 100'000;

constexpr Range kSeconds{0.0, kMaxScenarioS, "s"};
constexpr Range kLimit{0.1, kMaxScenarioS, "s"};
constexpr Range kRepeat{1, kMaxScenarioRepeats, ""};
constexpr Range kSteps{1, kMaxSteps, "steps"};
constexpr Range kShake{0.0, 1'000.0, "m/s2"};
constexpr Range kShakeRate{0.1, 50.0, "Hz"};
constexpr Range kWind{-200.0, 200.0, "m/s"};
constexpr Range kShare{0.0, 2.0, ""};
constexpr Range kDisk{0.001, 1e6, "MB"};
constexpr Range kLink{0.01, 10'000.0, "Mbit/s"};
constexpr Range kDelay{0.0, 5'000.0, "ms"};
constexpr Range kLoss{0.0, 0.5, ""};
constexpr Range kDrawing{0.0, 60'000.0, "ms"};
constexpr Range kSide{16, 4'096, "pixels"};
constexpr Range kStretch{1e-6, 100.0, ""};
constexpr Range kDecibel{1.0, 99.0, "dB"};
constexpr Range kMeasure{0.0, 1e9, ""};
constexpr Range kPort{1, 65'535, ""};
constexpr Range kDatagramBytes{1, kMaxScenarioDatagramBytes, "bytes"};
constexpr Range kDatagrams{1, 100'000, ""};
constexpr Range kDatagramRate{1.0, 10'000.0, "Hz"};
constexpr Range kAny{-1e300, 1e300, ""};

/// The first thing that is wrong with the file.
struct Findings {
  std::string place;
  std::optional<Error> error;
};

/// One message of the file: reads its fields, and says where a wrong one stands.
class Part {
 public:
  Part(const pb::Message& message, const pb::TextFormat::ParseInfoTree* tree, Findings& findings)
      : message_(message), tree_(tree), findings_(findings) {}

  bool has(const char* name) const { return message_.GetReflection()->HasField(message_, &field(name)); }

  double number(const char* name, double missing, const Range& range) const {
    if (!has(name)) return missing;
    const auto* reflection = message_.GetReflection();
    const auto& descriptor = field(name);
    const double value = descriptor.cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE
                             ? reflection->GetDouble(message_, &descriptor)
                             : static_cast<double>(reflection->GetUInt32(message_, &descriptor));
    if (!(value >= range.minimum && value <= range.maximum))
      fail(name, fmt::format("is {}, it must be within {:g} .. {:g}{}{}", value, range.minimum, range.maximum,
                             *range.unit ? " " : "", range.unit));
    return value;
  }
  uint32_t count(const char* name, uint32_t missing, const Range& range) const {
    const double value = number(name, missing, range);
    return value >= 0.0 && value <= static_cast<double>(UINT32_MAX) ? static_cast<uint32_t>(value) : missing;
  }
  std::optional<double> some(const char* name, const Range& range) const {
    if (!has(name)) return std::nullopt;
    return number(name, 0.0, range);
  }
  std::string text(const char* name, const std::string& missing, size_t limit_bytes) const {
    if (!has(name)) return missing;
    std::string value = message_.GetReflection()->GetString(message_, &field(name));
    check_text(name, value, limit_bytes);
    return value;
  }
  std::vector<std::string> texts(const char* name, size_t limit) const {
    const auto* reflection = message_.GetReflection();
    const auto size = static_cast<size_t>(reflection->FieldSize(message_, &field(name)));
    if (size > limit) fail(name, fmt::format("has {} entries, the limit is {}", size, limit));
    std::vector<std::string> values;
    for (size_t i = 0; i < std::min(size, limit); ++i) {
      values.push_back(reflection->GetRepeatedString(message_, &field(name), static_cast<int>(i)));
      check_text(name, values.back(), kMaxTextBytes);
    }
    return values;
  }
  /// One of the words.
  std::string word(const char* name, const std::string& missing,
                   const std::vector<std::string>& words) const {
    const std::string value = text(name, missing, kMaxWordBytes);
    if (std::find(words.begin(), words.end(), value) != words.end()) return value;
    std::string known;
    for (const std::string& one : words) known += (known.empty() ? "" : ", ") + one;
    fail(name, fmt::format("is '{}', it must be one of {}", value, known));
    return missing;
  }
  bool flag(const char* name) const {
    return has(name) && message_.GetReflection()->GetBool(message_, &field(name));
  }
  template <class Enum>
  Enum choice(const char* name, Enum last) const {
    const int value = message_.GetReflection()->GetEnumValue(message_, &field(name));
    if (value >= 1 && value <= static_cast<int>(last)) return static_cast<Enum>(value);
    fail(name, "is none of its values");
    return Enum::None;
  }
  glm::vec3 vector(const char* name, const glm::vec3& missing, const Range& range) const {
    if (!has(name)) return missing;
    const Part inner = group(name);
    glm::vec3 value = missing;
    const char* const names[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i)
      value[i] = static_cast<float>(inner.number(names[i], static_cast<double>(missing[i]), range));
    return value;
  }
  Part group(const char* name) const {
    const auto& descriptor = field(name);
    return {message_.GetReflection()->GetMessage(message_, &descriptor),
            tree_ ? tree_->GetTreeForNested(&descriptor, -1) : nullptr, findings_};
  }
  Part element(const char* name, int index) const {
    const auto& descriptor = field(name);
    return {message_.GetReflection()->GetRepeatedMessage(message_, &descriptor, index),
            tree_ ? tree_->GetTreeForNested(&descriptor, index) : nullptr, findings_};
  }
  int size(const char* name) const { return message_.GetReflection()->FieldSize(message_, &field(name)); }
  /// Of an element of a list, from 1; 0 = unknown.
  int line(const char* name, int index) const {
    return tree_ ? tree_->GetLocation(&field(name), index).line + 1 : 0;
  }

  /// `index`: of an element of a list.
  void fail(const char* name, const std::string& sentence, int index = 0) const {
    if (findings_.error) return;
    const auto& descriptor = field(name);
    const auto location = tree_ ? tree_->GetLocation(&descriptor, descriptor.is_repeated() ? index : -1)
                                : pb::TextFormat::ParseLocation();
    const std::string place =
        location.line < 0 ? findings_.place : place_at(findings_.place, location.line, location.column);
    findings_.error = at(place, make_error(ErrorCode::BadInput, "{} {}", name, sentence));
  }

 private:
  const pb::FieldDescriptor& field(const char* name) const {
    const auto* found = message_.GetDescriptor()->FindFieldByName(name);
    CHECK(found != nullptr);
    return *found;
  }
  void check_text(const char* name, const std::string& value, size_t limit_bytes) const {
    if (value.empty() || value.size() > limit_bytes || !is_printable(value))
      fail(name, fmt::format("must be 1 .. {} bytes of printable text", limit_bytes));
  }

  const pb::Message& message_;
  const pb::TextFormat::ParseInfoTree* tree_;
  Findings& findings_;
};

/// Reads a scenario; its paths start from `folder`.
class ScenarioReader {
 public:
  explicit ScenarioReader(std::filesystem::path folder) : folder_(std::move(folder)) {}

  Scenario read(const Part& file) const;

 private:
  ScenarioAction read_action(const Part& action) const;
  ScenarioStart read_start(const Part& part) const;
  ScenarioFeed read_feed(const Part& part) const;
  static ScenarioView read_view(const Part& part);
  static ScenarioLink read_link(const Part& part);
  ScenarioExpect read_expect(const Part& part) const;
  static ScenarioRefusal read_refusal(const Part& part);
  ScenarioSend read_send(const Part& part) const;
  /// The words stay as they are, anything else is a file.
  std::string word_or_file(const Part& part, const char* name, const std::string& missing,
                           const std::vector<std::string>& words) const;
  std::filesystem::path file(const Part& part, const char* name) const;

  const std::filesystem::path folder_;
};

std::filesystem::path ScenarioReader::file(const Part& part, const char* name) const {
  const std::string given = part.text(name, "", scene_fields::kMaxPathBytes);
  return given.empty() ? std::filesystem::path() : (folder_ / given).lexically_normal();
}

std::string ScenarioReader::word_or_file(const Part& part, const char* name, const std::string& missing,
                                         const std::vector<std::string>& words) const {
  const std::string given = part.text(name, missing, scene_fields::kMaxPathBytes);
  if (std::find(words.begin(), words.end(), given) != words.end()) return given;
  return (folder_ / given).lexically_normal().string();
}

/// Options of the server that write no file, open no port to others and load no code: who runs somebody's
/// scenario runs no more than the scenario.
constexpr std::array<std::string_view, 12> kScenarioOptions = {
    "--sim-device",     "--renderer",     "--gl-device", "--frame-viewers",
    "--viewer-mbit",    "--log-level",    "--mocap",     "--mocap-subject",
    "--messages-per-s", "--max-sessions", "--idle-ms",   "--stalled-ms"};

/// With or without a value behind '='.
bool is_scenario_option(std::string_view word) {
  return std::find(kScenarioOptions.begin(), kScenarioOptions.end(), word.substr(0, word.find('='))) !=
         kScenarioOptions.end();
}

ScenarioStart ScenarioReader::read_start(const Part& part) const {
  constexpr size_t kMaxWords = 64;
  ScenarioStart start;
  start.scene = file(part, "scene");
  start.overrides = part.texts("set", kMaxWords);
  start.is_lockstep = part.flag("lockstep");
  start.has_relay = part.flag("relay");
  start.records = part.flag("record");
  start.options = part.texts("option", kMaxWords);
  for (const std::string& word : start.options)
    if (word.starts_with('-') && !is_scenario_option(word))
      part.fail("option",
                fmt::format("is '{}', a scenario may give: {}", word, fmt::join(kScenarioOptions, ", ")));
  return start;
}

ScenarioFeed ScenarioReader::read_feed(const Part& part) const {
  ScenarioFeed feed;
  feed.motion = word_or_file(part, "motion", feed.motion, {"builtin", "shake", "still", "none"});
  feed.wind = word_or_file(part, "wind", feed.wind, {"gusts", "steady", "none"});
  feed.from_s = part.number("from_s", feed.from_s, kSeconds);
  feed.shake_mps2 = part.number("shake_mps2", feed.shake_mps2, kShake);
  feed.shake_hz = part.number("shake_hz", feed.shake_hz, kShakeRate);
  feed.wind_mps = part.vector("wind_mps", feed.wind_mps, kWind);
  feed.gust_intensity = part.number("gust_intensity", feed.gust_intensity, kShare);
  return feed;
}

ScenarioView ScenarioReader::read_view(const Part& part) {
  ScenarioView view;
  view.name = part.text("name", view.name, kMaxWordBytes);
  view.mode = part.word("mode", view.mode, {"strands", "frames", "auto"});
  if (part.has("link_mbit")) view.link_mbit = part.number("link_mbit", 0.0, kLink);
  view.delay_ms = part.number("delay_ms", view.delay_ms, kDelay);
  view.width = part.count("width", view.width, kSide);
  view.height = part.count("height", view.height, kSide);
  view.codec = part.text("codec", "", kMaxWordBytes);
  if (part.has("draws")) view.draws = part.word("draws", "", {"hardware", "software", "none"});
  view.draw_ms = part.number("draw_ms", view.draw_ms, kDrawing);
  return view;
}

ScenarioLink ScenarioReader::read_link(const Part& part) {
  ScenarioLink link;
  link.viewer = part.text("viewer", "", kMaxWordBytes);
  if (part.has("fault")) link.fault = part.choice("fault", ScenarioFault::Cut);
  link.loss = part.number("loss", link.loss, kLoss);
  link.delay_ms = part.number("delay_ms", link.delay_ms, kDelay);
  if (part.has("link_mbit")) link.link_mbit = part.number("link_mbit", 0.0, kLink);
  return link;
}

ScenarioExpect ScenarioReader::read_expect(const Part& part) const {
  ScenarioExpect expect;
  expect.viewer = part.text("viewer", "", kMaxWordBytes);
  expect.stretch_below = part.some("stretch_below", kStretch);
  expect.has_no_quarantine = part.flag("no_quarantine");
  expect.hash_file = file(part, "hash_file");
  expect.same_as = part.text("same_as", "", kMaxWordBytes);
  expect.kbit_below = part.some("kbit_below", kMeasure);
  expect.bits_per_vertex_below = part.some("bits_per_vertex_below", kMeasure);
  expect.realtime_above = part.some("realtime_above", kMeasure);
  expect.hz_above = part.some("hz_above", kMeasure);
  expect.back_within_s = part.some("back_within_s", kSeconds);
  expect.realtime_below = part.some("realtime_below", kMeasure);
  expect.feed_pace_within = part.some("feed_pace_within", kMeasure);
  expect.head_mps_below = part.some("head_mps_below", kMeasure);
  expect.order_above = part.some("order_above", kShare);
  expect.incoherent_below = part.some("incoherent_below", kShare);
  expect.cpu_share_below = part.some("cpu_share_below", kMeasure);
  expect.within_s = part.number("within_s", expect.within_s, kSeconds);
  if (part.has("slow_motion")) expect.is_slow = part.flag("slow_motion");
  if (part.has("mode")) expect.mode = part.word("mode", "", {"strands", "frames"});
  expect.because = part.text("because", "", kMaxTextBytes);
  if (!expect.because.empty() && expect.mode.empty()) part.fail("because", "is of a mode: say which");
  if (part.has("hash")) {
    const std::string text = part.text("hash", "", kMaxWordBytes);
    uint64_t hash = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), hash, 16);
    if (failure != std::errc() || end != text.data() + text.size())
      part.fail("hash", "must be up to 16 hexadecimal digits, as step prints them");
    expect.hash = hash;
  }
  if (part.has("picture")) {
    const Part inner = part.group("picture");
    ScenarioPicture picture;
    picture.golden = file(inner, "golden");
    picture.db_above = inner.number("db_above", picture.db_above, kDecibel);
    if (picture.golden.empty()) part.fail("picture", "needs a golden, the PNG file to compare with");
    expect.picture = picture;
  }
  if (part.has("metric")) {
    const Part inner = part.group("metric");
    ScenarioMetric metric;
    metric.name = inner.text("name", "", 4 * kMaxWordBytes);
    metric.below = inner.some("below", kAny);
    metric.above = inner.some("above", kAny);
    metric.equals = inner.some("equals", kAny);
    metric.within_s = inner.number("within_s", 0.0, kSeconds);
    if (metric.name.empty() || !(metric.below || metric.above || metric.equals))
      part.fail("metric", "needs a name, and below, above or equals");
    expect.metric = metric;
  }
  return expect;
}

ScenarioRefusal ScenarioReader::read_refusal(const Part& part) {
  ScenarioRefusal refusal;
  refusal.assignment = part.text("set", "", kMaxTextBytes);
  if (part.has("input")) refusal.input = part.choice("input", ScenarioInput::Overlong);
  refusal.says = part.text("says", "", kMaxTextBytes);
  return refusal;
}

/// Pairs of hexadecimal digits; blanks stand for nothing. Nothing for all else.
std::optional<std::vector<std::byte>> bytes_of(const std::string& hex) {
  std::string digits;
  std::copy_if(hex.begin(), hex.end(), std::back_inserter(digits), [](char c) { return c != ' '; });
  std::vector<std::byte> bytes;
  for (size_t i = 0; i + 1 < digits.size(); i += 2) {
    uint8_t value = 0;
    const char* const end = digits.data() + i + 2;
    const auto [read_to, failure] = std::from_chars(digits.data() + i, end, value, 16);
    if (failure != std::errc() || read_to != end) return std::nullopt;
    bytes.push_back(std::byte{value});
  }
  if (bytes.empty() || digits.size() % 2 != 0) return std::nullopt;
  return bytes;
}

ScenarioSend ScenarioReader::read_send(const Part& part) const {
  constexpr size_t kMaxDatagrams = 64;
  ScenarioSend send;
  send.port = static_cast<uint16_t>(part.count("port", 1, kPort));
  for (const std::string& hex : part.texts("hex", kMaxDatagrams)) {
    const auto bytes = bytes_of(hex);
    if (!bytes) part.fail("hex", "must be pairs of hexadecimal digits: \"2f 61 00\"");
    if (bytes) send.datagrams.push_back(*bytes);
  }
  for (const std::string& name : part.texts("file", kMaxDatagrams))
    send.files.push_back((folder_ / name).lexically_normal());
  if (part.has("random_bytes")) send.random_bytes = part.count("random_bytes", 1, kDatagramBytes);
  send.count = part.count("count", send.count, kDatagrams);
  send.rate_hz = part.number("rate_hz", send.rate_hz, kDatagramRate);
  if (send.datagrams.empty() && send.files.empty() && send.random_bytes == 0)
    part.fail("port", "gets nothing: say what with hex, file or random_bytes");
  return send;
}

ScenarioAction ScenarioReader::read_action(const Part& part) const {
  ScenarioAction action;
  if (part.has("start")) {
    action.work = read_start(part.group("start"));
  } else if (part.has("feed")) {
    action.work = read_feed(part.group("feed"));
  } else if (part.has("step")) {
    action.work = ScenarioSteps{part.count("step", 1, kSteps)};
  } else if (part.has("run_s")) {
    action.work = ScenarioRunTime{part.number("run_s", 1.0, kSeconds)};
  } else if (part.has("set")) {
    action.work = ScenarioSet{part.text("set", "", kMaxTextBytes)};
  } else if (part.has("command")) {
    action.work = part.choice("command", ScenarioCommand::RestartRelay);
  } else if (part.has("view")) {
    action.work = read_view(part.group("view"));
  } else if (part.has("link")) {
    action.work = read_link(part.group("link"));
  } else if (part.has("disk")) {
    action.work = ScenarioDisk{part.group("disk").some("full_at_mb", kDisk)};
  } else if (part.has("leave")) {
    action.work = ScenarioLeave{part.text("leave", "", kMaxWordBytes)};
  } else if (part.has("expect")) {
    action.work = read_expect(part.group("expect"));
  } else if (part.has("refuse")) {
    const ScenarioRefusal refusal = read_refusal(part.group("refuse"));
    if ((refusal.input == ScenarioInput::None) == refusal.assignment.empty())
      part.fail("refuse", "needs either an input or a set");
    action.work = refusal;
  } else if (part.has("send")) {
    if (!part.group("send").has("port")) part.fail("send", "needs the port that it sends to");
    action.work = read_send(part.group("send"));
  } else if (part.has("remember")) {
    action.work = ScenarioRemember{part.text("remember", "", kMaxWordBytes)};
  } else {
    action.line = -1;  // says nothing to do
  }
  return action;
}

Scenario ScenarioReader::read(const Part& file) const {
  Scenario scenario;
  scenario.name = file.text("name", "", kMaxWordBytes);
  scenario.folder = folder_;
  scenario.about = file.text("about", "", kMaxTextBytes);
  scenario.limit_s = file.number("limit_s", scenario.limit_s, kLimit);
  scenario.repeat = file.count("repeat", 1, kRepeat);
  bool records = false;  // the server that was started
  const int count = file.size("do");
  if (static_cast<size_t>(count) > kMaxScenarioActions)
    file.fail("do", fmt::format("has {} entries, the limit is {}", count, kMaxScenarioActions));
  for (int i = 0; i < std::min(count, static_cast<int>(kMaxScenarioActions)); ++i) {
    ScenarioAction action = read_action(file.element("do", i));
    if (action.line < 0) file.fail("do", fmt::format("number {} says nothing to do", i + 1), i);
    action.line = file.line("do", i);
    if (std::holds_alternative<ScenarioDisk>(action.work) && !records)
      file.fail("do",
                fmt::format("number {} is about a disk that nothing is written to: begin with start "
                            "{{ record: true }}",
                            i + 1),
                i);
    if (const auto* start = std::get_if<ScenarioStart>(&action.work)) records = start->records;
    scenario.actions.push_back(std::move(action));
  }
  return scenario;
}

}  // namespace

Result<Scenario> parse_scenario(const std::string& text, const std::string& place,
                                const std::filesystem::path& folder) {
  if (text.size() > kMaxScenarioFileBytes)
    return at(place, make_error(ErrorCode::LimitExceeded, "the scenario has {} bytes, the limit is {}",
                                text.size(), kMaxScenarioFileBytes));
  v1::Scenario message;
  TextErrors errors;
  pb::TextFormat::ParseInfoTree tree;
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  parser.WriteLocationsTo(&tree);
  parser.SetRecursionLimit(kMaxScenarioNesting);
  if (!parser.ParseFromString(text, &message)) return errors.error(place);
  Findings findings{place, {}};
  Scenario scenario = ScenarioReader(folder).read(Part(message, &tree, findings));
  if (findings.error) return *findings.error;
  if (scenario.name.empty()) return at(place, make_error(ErrorCode::BadInput, "the scenario has no name"));
  if (scenario.actions.empty())
    return at(place, make_error(ErrorCode::BadInput, "the scenario does nothing: it has no do {{ .. }}"));
  return scenario;
}

Result<Scenario> load_scenario(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxScenarioFileBytes));
  return parse_scenario(text, path.string(), std::filesystem::absolute(path).parent_path());
}

}  // namespace strandcast
