#include "server/report/stream_view_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/base/units.h"
#include "common/plot/svg_plot.h"
#include "server/report/report_files.h"

namespace strandcast {
namespace {

constexpr int kViewSheetQuality = 95;

const StreamViewRow* row_of(const StreamView& view, const std::string& codec, double distance_m,
                            double bound_m) {
  for (const StreamViewRow& row : view.rows)
    if (row.codec == codec && row.distance_m == distance_m && row.bound_m == bound_m) return &row;
  return nullptr;
}

/// Those that took part, in the order in which they did, then those that this build does not have.
std::vector<std::string> picture_codecs(const StreamView& view) {
  std::vector<std::string> names;
  for (const PixelPoint& point : view.pixels)
    if (std::find(names.begin(), names.end(), point.codec) == names.end()) names.push_back(point.codec);
  names.insert(names.end(), view.missing.begin(), view.missing.end());
  return names;
}

/// "41.5 dB"; "SSIM 0.991".
std::string look_words(double psnr_db, double ssim, LookMeasure measure) {
  return measure == LookMeasure::Psnr ? fmt::format("{:.1f} dB", psnr_db) : fmt::format("SSIM {:.4f}", ssim);
}

/// What pictures need to look as good, or why that cannot be said.
HtmlCell need_of(const StreamView& view, const std::string& codec, const StreamViewRow& strands,
                 LookMeasure measure) {
  if (std::find(view.missing.begin(), view.missing.end(), codec) != view.missing.end()) return "not built in";
  if (const auto mbit_per_s =
          mbit_per_s_for(view.pixels, codec, strands.distance_m, measure, look_db(strands, measure)))
    return fmt::format("{:.1f} ({:.1f} times)", *mbit_per_s, *mbit_per_s / strands.mbit_per_s);
  const PixelPoint* best = nullptr;
  for (const PixelPoint& point : view.pixels)
    if (point.codec == codec && point.distance_m == strands.distance_m &&
        (best == nullptr || look_db(point, measure) > look_db(*best, measure)))
      best = &point;
  if (best == nullptr) return "not measured";
  return fmt::format("never: {} with {:.1f}", look_words(best->psnr_db, best->ssim, measure),
                     best->mbit_per_s);
}

std::string way_words(Interpolation way) {
  return way == Interpolation::None ? "the state before" : to_string(way);
}

/// The best that any picture codec does with the strands' rate.
std::string look_with_same_rate(const StreamView& view, const StreamViewRow& strands) {
  std::string best;
  double best_db = 0.0;
  for (const std::string& codec : picture_codecs(view)) {
    const auto psnr_db = psnr_db_at(view.pixels, codec, strands.distance_m, strands.mbit_per_s);
    if (!psnr_db || *psnr_db <= best_db) continue;
    best_db = *psnr_db;
    best = fmt::format("{:.1f} dB ({})", *psnr_db, codec);
  }
  return best.empty() ? "none takes so little" : best;
}

}  // namespace

HtmlTable view_table(const StreamView& view) {
  HtmlTable table;
  table.columns = {"codec", "bound, mm"};
  for (const double distance_m : kViewDistancesM)
    for (const char* measure : {"PSNR, dB", "SSIM", "dE"})
      table.columns.push_back(fmt::format("{:g} m: {}", distance_m, measure));
  table.columns.emplace_back("strands, Mbit/s");
  for (const char* codec : kViewCodecs)
    for (const double bound_m : kViewBoundsM) {
      std::vector<HtmlCell> cells = {codec, fmt::format("{:g}", kMmPerM * bound_m)};
      double mbit_per_s = 0.0;
      for (const double distance_m : kViewDistancesM) {
        const StreamViewRow* row = row_of(view, codec, distance_m, bound_m);
        if (row == nullptr) break;
        cells.emplace_back(fmt::format("{:.1f}", row->psnr_db));
        cells.emplace_back(fmt::format("{:.3f}", row->ssim));
        cells.emplace_back(fmt::format("{:.2f}", row->delta_e));
        mbit_per_s = row->mbit_per_s;
      }
      cells.emplace_back(fmt::format("{:.2f}", mbit_per_s));
      if (cells.size() == table.columns.size()) table.rows.push_back(std::move(cells));
    }
  return table;
}

std::string view_plot(const StreamView& view) {
  PlotDesc desc;
  desc.title = "What is left of the picture";
  desc.x.title = "largest error allowed for any vertex, mm";
  desc.y.title = "PSNR in the hair's pixels, dB";
  desc.y.scale = PlotScale::Linear;
  for (const char* codec : kViewCodecs)
    for (const double distance_m : kViewDistancesM) {
      PlotSeries series;
      series.name = fmt::format("{} from {:g} m", codec, distance_m);
      for (const StreamViewRow& row : view.rows)
        if (row.codec == codec && row.distance_m == distance_m)
          series.points.push_back({kMmPerM * row.bound_m, row.psnr_db,
                                   fmt::format("{}: {:.1f} dB, SSIM {:.3f}, {:.2f} Mbit/s", series.name,
                                               row.psnr_db, row.ssim, row.mbit_per_s)});
      if (!series.points.empty()) desc.series.push_back(std::move(series));
    }
  return make_svg_plot(desc);
}

HtmlTable pixel_table(const StreamView& view, LookMeasure measure) {
  HtmlTable table;
  table.caption =
      measure == LookMeasure::Psnr ? "As good by PSNR, of all colours" : "As good by SSIM, of brightness";
  table.columns = {"strands", "their look", "their Mbit/s"};
  const std::vector<std::string> codecs = picture_codecs(view);
  for (const std::string& codec : codecs) table.columns.push_back(codec + ", Mbit/s for it");
  if (measure == LookMeasure::Psnr) table.columns.emplace_back("pictures with the strands' Mbit/s");
  for (const double distance_m : kViewDistancesM)
    for (const char* strand_codec : kViewCodecs)
      for (const double bound_m : kViewBoundsM) {
        const StreamViewRow* row = row_of(view, strand_codec, distance_m, bound_m);
        if (row == nullptr) continue;
        std::vector<HtmlCell> cells = {
            fmt::format("{} at {:g} mm from {:g} m", strand_codec, kMmPerM * bound_m, distance_m),
            look_words(row->psnr_db, row->ssim, measure), fmt::format("{:.2f}", row->mbit_per_s)};
        for (const std::string& codec : codecs) cells.push_back(need_of(view, codec, *row, measure));
        if (measure == LookMeasure::Psnr) cells.emplace_back(look_with_same_rate(view, *row));
        table.rows.push_back(std::move(cells));
      }
  return table;
}

std::string pixel_plot(const StreamView& view, double distance_m) {
  PlotDesc desc;
  desc.title = fmt::format("Look against Mbit/s from {:g} m, {} x {} at 60 Hz", distance_m, view.size.width,
                           view.size.height);
  desc.x.title = "Mbit/s";
  desc.y.title = "PSNR in the hair's pixels, dB";
  desc.y.scale = PlotScale::Linear;
  for (const char* codec : kViewCodecs) {
    PlotSeries strands;
    strands.name = fmt::format("strands, {}", codec);
    for (const StreamViewRow& row : view.rows)
      if (row.codec == codec && row.distance_m == distance_m)
        strands.points.push_back({row.mbit_per_s, row.psnr_db,
                                  fmt::format("{} at {:g} mm: {:.1f} dB, {:.2f} Mbit/s", codec,
                                              kMmPerM * row.bound_m, row.psnr_db, row.mbit_per_s)});
    if (!strands.points.empty()) desc.series.push_back(std::move(strands));
  }
  for (const std::string& codec : picture_codecs(view)) {
    PlotSeries series;
    series.name = "pictures, " + codec;
    for (const PixelPoint& point : view.pixels)
      if (point.codec == codec && point.distance_m == distance_m)
        series.points.push_back({point.mbit_per_s, point.psnr_db,
                                 fmt::format("{}, {}: {:.1f} dB, {:.1f} Mbit/s", codec, point.setting,
                                             point.psnr_db, point.mbit_per_s)});
    if (!series.points.empty()) desc.series.push_back(std::move(series));
  }
  return make_svg_plot(desc);
}

void add_view_sections(HtmlPage& page, const StreamView& view) {
  if (view.rows.empty()) return;
  page.heading("How it looks");
  page.paragraph(fmt::format(
      "Pictures of {} x {} pixels drawn in tiles from decoded strands (step is told all of the wind), "
      "against pictures of the exact "
      "32-bit floats: {} of the median half second of {}, {} strands simulated and {} drawn. Only the hair "
      "counts: pixels of either picture that change when strands are drawn in other colours, so that skin in "
      "the hair's shadow does not. At 40 dB a difference is hard "
      "to "
      "find beside the exact picture. Strands finer than a pixel flicker by themselves: part of every "
      "difference is theirs, and OpenGL's quads, which draw looks that name a method, add to it.",
      view.size.width, view.size.height, view.compared_pictures, view.motion, to_string(view.strands),
      view.drawn_strands));
  page.table(view_table(view));
  page.figure(view_plot(view), "Higher is better; 40 dB is hard to tell from exact.");
  for (const ViewSheet& sheet : view.sheets)
    if (const auto jpeg = encode_jpeg(sheet.image, kViewSheetQuality)) page.picture(*jpeg, sheet.caption);
  page.heading("Strands or pictures?");
  std::string missing;
  if (!view.missing.empty())
    missing = fmt::format(" This build has no encoder for {}: see STRANDCAST_H264 in docs/use/try-it.md.",
                          fmt::join(view.missing, ", "));
  page.paragraph(fmt::format(
      "What the project's picture codecs need at 60 pictures a second to be as near to the exact picture as "
      "strands are, on the same clip and in the same pixels; the first picture and those right after it are "
      "left out on both sides. Strands take the same whatever the size and number of views; pictures take no "
      "drawing by the viewer. \"Never\" names the best of a codec's settings: all of them halve the colours, "
      "and video is bound by its finest quantiser.{}",
      missing));
  page.table(pixel_table(view, LookMeasure::Psnr));
  page.table(pixel_table(view, LookMeasure::Ssim));
  for (const double distance_m : kViewDistancesM)
    page.figure(pixel_plot(view, distance_m), "Upper left is better.");
}

HtmlTable playout_table(const std::vector<PlayoutRow>& rows) {
  HtmlTable table;
  table.columns = {"head", "shown between states", "off in the world, rms mm", "PSNR, dB", "SSIM", "dE"};
  for (const PlayoutRow& row : rows)
    table.rows.push_back({row.motion, way_words(row.interpolation),
                          fmt::format("{:.3f}", kMmPerM * row.rms_error_m),
                          fmt::format("{:.1f}", row.psnr_db), fmt::format("{:.3f}", row.ssim),
                          fmt::format("{:.2f}", row.delta_e)});
  return table;
}

void add_playout_section(HtmlPage& page, const std::vector<PlayoutRow>& rows, const std::string& note) {
  if (rows.empty()) return;
  page.heading("Between states");
  page.paragraph(fmt::format(
      "Smooth playout of 30 states a second: pictures of moments halfway between two states, against the "
      "picture of "
      "the state that was there at 60 Hz, {} of each head's median half second, near, in the hair's pixels. "
      "The line is "
      "shown one frame late, the cubic two. States are the exact floats; the camera goes along with the head "
      "that is shown. {}",
      rows.front().compared_pictures, note));
  page.table(playout_table(rows));
}

std::string playout_csv(const std::vector<PlayoutRow>& rows) {
  CsvFile csv(
      {"motion", "solver", "interpolation", "pictures", "rms_error_mm", "psnr_db", "ssim", "delta_e"});
  for (const PlayoutRow& row : rows)
    csv.add_row({row.motion, row.solver, to_string(row.interpolation),
                 fmt::format("{}", row.compared_pictures), csv_number(kMmPerM * row.rms_error_m),
                 csv_number(row.psnr_db), csv_number(row.ssim), csv_number(row.delta_e)});
  return csv.text();
}

std::string view_csv(const StreamView& view) {
  CsvFile csv({"codec", "distance_m", "bound_mm", "psnr_db", "ssim", "delta_e", "hair_share", "mbit_per_s",
               "width", "height"});
  for (const StreamViewRow& row : view.rows)
    csv.add_row({row.codec, csv_number(row.distance_m), csv_number(kMmPerM * row.bound_m),
                 csv_number(row.psnr_db), csv_number(row.ssim), csv_number(row.delta_e),
                 csv_number(row.hair_share), csv_number(row.mbit_per_s), fmt::format("{}", view.size.width),
                 fmt::format("{}", view.size.height)});
  return csv.text();
}

std::string pixel_csv(const StreamView& view) {
  CsvFile csv({"distance_m", "codec", "setting", "mbit_per_s", "psnr_db", "ssim"});
  for (const PixelPoint& point : view.pixels)
    csv.add_row({csv_number(point.distance_m), point.codec, point.setting, csv_number(point.mbit_per_s),
                 csv_number(point.psnr_db), csv_number(point.ssim)});
  return csv.text();
}

}  // namespace strandcast
