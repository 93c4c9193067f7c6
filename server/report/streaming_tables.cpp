#include "server/report/streaming_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/scene/scene_desc.h"
#include "server/report/streaming_goals.h"

namespace strandcast {
namespace {

constexpr double kPhoneSlowdown = 4.0;
constexpr double kLeastMs = 1e-3;
constexpr MotionLevel kLevels[] = {MotionLevel::Idle, MotionLevel::Active, MotionLevel::Violent};

bool is_same(const StreamSize& a, const StreamSize& b) {
  return a.strand_count == b.strand_count && a.vertex_count == b.vertex_count;
}

/// A decimal more where one would leave a single digit.
std::string mbit_text(const StreamingRow& row) {
  return fmt::format("{:.{}f}", row.mbit_per_s(), row.mbit_per_s() < 1.0 ? 2 : 1);
}

/// What the table is of: the built-in scene's size and the largest, those that were measured.
std::vector<StreamSize> needed_sizes(const StreamingReport& report) {
  std::vector<StreamSize> sizes;
  const auto take = [&](const StreamSize& size) {
    if (std::none_of(sizes.begin(), sizes.end(), [&](const StreamSize& s) { return is_same(s, size); }))
      sizes.push_back(size);
  };
  const SceneDesc scene = built_in_scene();
  const auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
  const StreamSize built_in{groom.strand_count, groom.vertex_count};
  const StreamSize* largest = nullptr;
  for (const StreamingRow& row : report.rows) {
    if (is_same(row.size, built_in)) take(row.size);
    if (largest == nullptr || row.size.vertices() > largest->vertices()) largest = &row.size;
  }
  if (largest != nullptr) take(*largest);
  return sizes;
}

/// Of the first solver, at the goals' bound.
struct NeedColumn {
  StreamSize size;
  MotionLevel level = MotionLevel::Idle;
  std::string motion;  // the first of the class
};

bool is_needed(const StreamingReport& report, const StreamingRow& row) {
  return row.solver == report.solver && row.part == MotionPart::Median &&
         (row.bound_m == kGoalBoundM || row.is_bound_free);
}

std::vector<NeedColumn> need_columns(const StreamingReport& report) {
  std::vector<NeedColumn> columns;
  for (const StreamSize& size : needed_sizes(report))
    for (const MotionLevel level : kLevels) {
      const auto row = std::find_if(report.rows.begin(), report.rows.end(), [&](const StreamingRow& one) {
        return is_needed(report, one) && is_same(one.size, size) && one.motion_level == level;
      });
      if (row != report.rows.end()) columns.push_back({size, level, row->motion});
    }
  return columns;
}

const StreamingRow* row_in(const StreamingReport& report, const NeedColumn& column,
                           const std::string& codec) {
  for (const StreamingRow& row : report.rows)
    if (is_needed(report, row) && row.codec_and_wind() == codec && row.motion == column.motion &&
        is_same(row.size, column.size))
      return &row;
  return nullptr;
}

/// The best peer of a kind there, nullptr where none ran.
const StreamingRow* peer_in(const StreamingReport& report, const NeedColumn& column, PeerKind kind) {
  const StreamingRow* ours = row_in(report, column, "tangent");
  return ours != nullptr ? best_peer(report, *ours, kind) : nullptr;
}

/// Columns whose times are shown: walking at each size, else what there is.
std::vector<NeedColumn> timed_columns(const std::vector<NeedColumn>& columns) {
  std::vector<NeedColumn> timed;
  for (const NeedColumn& column : columns) {
    const auto same = std::find_if(timed.begin(), timed.end(),
                                   [&](const NeedColumn& t) { return is_same(t.size, column.size); });
    if (same == timed.end())
      timed.push_back(column);
    else if (column.level == MotionLevel::Active)
      *same = column;
  }
  return timed;
}

/// Those of ours, the one with the fewest bits of all first.
std::vector<std::string> own_codecs(const StreamingReport& report) {
  std::vector<std::pair<double, std::string>> codecs;
  for (const StreamingRow& row : report.rows) {
    if (!row.is_ours || !is_needed(report, row)) continue;
    const auto known = std::find_if(codecs.begin(), codecs.end(),
                                    [&](const auto& codec) { return codec.second == row.codec_and_wind(); });
    if (known == codecs.end())
      codecs.emplace_back(row.bits, row.codec_and_wind());
    else
      known->first = std::min(known->first, row.bits);
  }
  std::stable_sort(codecs.begin(), codecs.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> names;
  for (const auto& [bits, name] : codecs) names.push_back(name);
  return names;
}

std::vector<HtmlCell> needs_row(std::string name, const std::vector<NeedColumn>& columns,
                                const std::function<const StreamingRow*(const NeedColumn&)>& row_at) {
  std::vector<HtmlCell> cells = {std::move(name)};
  for (const NeedColumn& column : columns) {
    const StreamingRow* row = row_at(column);
    cells.emplace_back(row != nullptr ? mbit_text(*row) : "");
  }
  for (const NeedColumn& column : timed_columns(columns)) {
    const StreamingRow* row = row_at(column);
    cells.emplace_back(row != nullptr ? fmt::format("{:.1f} + {:.1f}", row->encode_cpu_ms, row->decode_cpu_ms)
                                      : "");
  }
  return cells;
}

}  // namespace

HtmlTable needs_table(const StreamingReport& report) {
  const std::vector<NeedColumn> columns = need_columns(report);
  HtmlTable table;
  table.caption = fmt::format(
      "Mbit/s at 60 Hz with every vertex within {:g} mm; processor milliseconds of the server + of the "
      "viewer, "
      "per state",
      1e3 * kGoalBoundM);
  table.columns = {"codec"};
  for (const NeedColumn& column : columns)
    table.columns.push_back(fmt::format("{}, {}: Mbit/s", to_string(column.size), to_string(column.level)));
  for (const NeedColumn& column : timed_columns(columns))
    table.columns.push_back(fmt::format("{}: ms", to_string(column.size)));
  for (const std::string& codec : own_codecs(report))
    table.rows.push_back(
        needs_row(codec, columns, [&](const NeedColumn& column) { return row_in(report, column, codec); }));
  const std::pair<PeerKind, const char*> peers[] = {
      {PeerKind::Temporal, "best other, with a prediction in time"},
      {PeerKind::Plain, "best other, positions"}};
  for (const auto& [kind, name] : peers)
    table.rows.push_back(needs_row(name, columns, [&, peer_kind = kind](const NeedColumn& column) {
      return peer_in(report, column, peer_kind);
    }));
  return table;
}

HtmlTable reach_table(const StreamingReport& report) {
  constexpr uint32_t kCounts[] = {1'000, 10'000, 100'000};
  const std::vector<NeedColumn> columns = timed_columns(need_columns(report));
  HtmlTable table;
  if (columns.empty()) return table;
  const NeedColumn& column = *std::max_element(
      columns.begin(), columns.end(),
      [](const NeedColumn& a, const NeedColumn& b) { return a.size.vertices() < b.size.vertices(); });
  table.caption = fmt::format(
      "Measured with {} vertices, {}; for other counts Mbit/s follow from the bits a vertex, and of exact "
      "frames stay as they are. A phone's core in a browser is taken as {:g} times slower than one here; a "
      "viewer gives half of it.",
      to_string(column.size), to_string(column.level), kPhoneSlowdown);
  table.columns = {"codec", "bits/vertex"};
  for (const uint32_t count : kCounts) table.columns.push_back(fmt::format("{} strands: Mbit/s", count));
  table.columns.insert(table.columns.end(),
                       {"server, ms", "viewer, ms", "a phone has time for, strands at 60 Hz"});
  std::vector<const StreamingRow*> rows;
  for (const StreamingRow& row : report.rows)
    if (is_needed(report, row) && row.motion == column.motion && is_same(row.size, column.size) &&
        row.keeps_bound())
      rows.push_back(&row);
  std::stable_sort(rows.begin(), rows.end(),
                   [](const StreamingRow* a, const StreamingRow* b) { return a->bits < b->bits; });
  for (const StreamingRow* row : rows) {
    std::vector<HtmlCell> cells = {row->codec_and_wind(), fmt::format("{:.3f}", row->bits)};
    for (const uint32_t count : kCounts) {
      const double share =
          row->codec == kExactCodec ? 1.0 : static_cast<double>(count) / row->size.strand_count;
      cells.emplace_back(fmt::format("{:.2f}", share * row->mbit_per_s()));
    }
    cells.emplace_back(fmt::format("{:.2f}", row->encode_cpu_ms));
    cells.emplace_back(fmt::format("{:.2f}", row->decode_cpu_ms));
    const double phone_ms = kPhoneSlowdown * std::max(row->decode_cpu_ms, kLeastMs);
    const double strands = 0.5 * 1e3 * kStreamFrameS / phone_ms * row->size.strand_count;
    cells.emplace_back(fmt::format("{:.0f}", 100.0 * std::floor(strands / 100.0)));
    table.rows.push_back(std::move(cells));
  }
  return table;
}

std::string needs_text(const StreamingReport& report) {
  const std::vector<NeedColumn> columns = need_columns(report);
  std::string text;
  for (const StreamSize& size : needed_sizes(report)) {
    std::vector<std::string> parts;
    for (const NeedColumn& column : columns) {
      if (!is_same(column.size, size)) continue;
      const StreamingRow* best = nullptr;
      for (const std::string& codec : own_codecs(report))
        if (const StreamingRow* row = row_in(report, column, codec);
            row != nullptr && (best == nullptr || row->bits < best->bits))
          best = row;
      if (best != nullptr)
        parts.push_back(fmt::format("{} Mbit/s {} ({})", mbit_text(*best), to_string(column.level),
                                    best->codec_and_wind()));
    }
    if (!parts.empty())
      text += fmt::format("{}{} strands of {} vertices take {}.", text.empty() ? "" : " ", size.strand_count,
                          size.vertex_count, fmt::join(parts, ", "));
  }
  return text.empty() ? "Nothing was measured at 0.1 mm." : text;
}

HtmlTable case_table(const StreamingReport& report) {
  HtmlTable table;
  table.columns = {"clip", "part", "strand model", "codec", "wind told"};
  for (const double bound_m : kStreamBoundsM)
    table.columns.push_back(fmt::format("{:g} mm: bits/vertex", 1e3 * bound_m));
  table.columns.emplace_back("keyframe");
  table.columns.emplace_back("encode, ms of one core");
  table.columns.emplace_back("decode, ms of one core");
  if (report.rows.empty()) return table;
  const StreamSize first = report.rows.front().size;
  table.caption = to_string(first) + " vertices; keyframe and times at 0.1 mm";
  for (const StreamingRow& row : report.rows) {
    // What keeps nothing in mind takes the same everywhere.
    if (!row.is_ours || !row.is_temporal || row.bound_m != kGoalBoundM || !is_same(row.size, first)) continue;
    std::vector<HtmlCell> cells = {row.motion, to_string(row.part), row.solver, row.codec,
                                   row.wind.empty() ? "does not ask" : row.wind};
    for (const double bound_m : kStreamBoundsM) {
      const auto at_bound =
          std::find_if(report.rows.begin(), report.rows.end(), [&](const StreamingRow& one) {
            return one.is_same_recording(row) && one.codec_and_wind() == row.codec_and_wind() &&
                   one.bound_m == bound_m;
          });
      cells.emplace_back(at_bound != report.rows.end() ? fmt::format("{:.2f}", at_bound->bits) : "");
    }
    cells.emplace_back(fmt::format("{:.2f}", row.join_bits));
    cells.emplace_back(fmt::format("{:.2f}", row.encode_cpu_ms));
    cells.emplace_back(fmt::format("{:.2f}", row.decode_cpu_ms));
    table.rows.push_back(std::move(cells));
  }
  return table;
}

std::string clips_text(const StreamingReport& report) {
  const bool has_clips = std::any_of(report.rows.begin(), report.rows.end(), [](const StreamingRow& row) {
    return !row.motion.starts_with("built-in ");
  });
  std::string text = has_clips ? "" : "All heads are built in: no captured clip took part. ";
  return text + fmt::format("{}", fmt::join(report.clip_notes, " "));
}

}  // namespace strandcast
