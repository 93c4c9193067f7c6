#include "server/report/collision_study.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"
#include "server/report/report_files.h"

namespace strandcast {
namespace {

constexpr int kPictureQuality = 85;
/// Depth in the mesh beyond which a person sees that settled hair is inside.
constexpr double kSeenM = 0.0005;

std::string mm(double metres) {
  return fmt::format("{:.3f}", 1e3 * metres);
}

std::string ms(double milliseconds) {
  return fmt::format("{:.2f}", milliseconds);
}

void add_head(HtmlPage& page, const CollisionStudy& study) {
  page.heading("What keeps hair out of the head");
  page.paragraph(fmt::format(
      "{} strands of {} vertices by {}, shaken by 10 g at 5 Hz while the head says no at 3 Hz, then held. "
      "How "
      "deep hair gets is looked up in the same field of {} cells for all, below the clearance that each "
      "place "
      "has in the groom as loaded (half a millimetre, or less where the groom has less); at rest also in the "
      "mesh itself. Spheres fill the head from within, so hair may lie under the skin between them.",
      study.strand_count, study.vertex_count, study.solver, kTrueFieldResolution));
  page.figure(head_collision_plot(study),
              "How deep 99.9 % of all vertices stay in the shake, against processor time over a step without "
              "the head.");
  HtmlTable table{"",
                  {"head", "cell, mm", "ms a step", "over none", "shaken, 99.9 %, mm", "deepest, mm",
                   "between vertices, mm", "settled, mm", "in the mesh, mm", "at rest, mm/s", "load, ms"},
                  {}};
  for (const HeadCollision& head : study.head)
    table.rows.push_back({head.name,
                          head.resolution == 0 ? "" : mm(head.cell_m),
                          ms(head.step_cpu_ms),
                          ms(head.extra_cpu_ms),
                          mm(head.shaken.vertex_usual_m),
                          mm(head.shaken.vertex_most_m),
                          mm(head.shaken.middle_most_m),
                          mm(head.settled.vertex_most_m),
                          {mm(head.mesh_m), head.mesh_m > kSeenM ? HtmlMark::Bad : HtmlMark::Good},
                          fmt::format("{:.2f}", 1e3 * head.rest_speed_mps),
                          fmt::format("{:.0f}", head.load_ms)});
  page.table(table);
}

void add_body(HtmlPage& page, const CollisionStudy& study) {
  page.heading("How hair answers to a body that moves by itself");
  page.paragraph(fmt::format(
      "Motion: {}; the fastest end of a capsule goes {:.2f} m/s. \"turn\" and \"sphere\" (Woodhouse 2017, "
      "figure 4.1) "
      "turn "
      "segments at their length, \"project\" moves vertices out the shortest way, \"force\" pushes with the "
      "depth "
      "(Sams 2014, 3.3). Carried is the share of a belt's way that lying tips go along with, by a friction "
      "of 1.",
      study.body_name, study.fastest_mps));
  page.figure(body_answer_plot(study),
              "How deep 99.9 % of all vertices stay, against processor time over a step without the body.");
  HtmlTable table{"",
                  {"answer", "ms a step", "over none", "99.9 %, mm", "deepest, mm", "between vertices, mm",
                   "lengths off", "at rest, mm/s", "carried"},
                  {}};
  for (const BodyAnswer& answer : study.body)
    table.rows.push_back({answer.name, ms(answer.step_cpu_ms), ms(answer.extra_cpu_ms),
                          mm(answer.depth.vertex_usual_m), mm(answer.depth.vertex_most_m),
                          mm(answer.depth.middle_most_m), fmt::format("{:.2g}", answer.stretch),
                          fmt::format("{:.2f}", 1e3 * answer.rest_speed_mps),
                          fmt::format("{:.0f} %", 100.0 * answer.carried_share)});
  page.table(table);
  if (study.moments.rgba.empty()) return;
  if (const auto jpeg = encode_jpeg(study.moments, kPictureQuality))
    page.picture(*jpeg, fmt::format("Four moments by \"{}\", from the front and from the left; balls where "
                                    "colliders are.",
                                    study.body.size() > 1 ? study.body[1].name : ""));
}

}  // namespace

std::string collision_summary(const CollisionStudy& study) {
  std::string text;
  for (const HeadCollision& head : study.head)
    text += fmt::format(
        "{}: {:+.2f} ms a step; shaken {} mm deep at most (99.9 %: {}), settled {} mm, {} mm in the mesh\n",
        head.name, head.extra_cpu_ms, mm(head.shaken.vertex_most_m), mm(head.shaken.vertex_usual_m),
        mm(head.settled.vertex_most_m), mm(head.mesh_m));
  for (const BodyAnswer& answer : study.body)
    text += fmt::format(
        "{}: {:+.2f} ms a step; {} mm deep at most (99.9 %: {}), lengths off by {:.2g}, {:.2f} mm/s at rest, "
        "{:.0f} % carried\n",
        answer.name, answer.extra_cpu_ms, mm(answer.depth.vertex_most_m), mm(answer.depth.vertex_usual_m),
        answer.stretch, 1e3 * answer.rest_speed_mps, 100.0 * answer.carried_share);
  return text;
}

std::string head_collision_csv(const CollisionStudy& study) {
  CsvFile csv({"head", "resolution", "cell_m", "load_ms", "step_cpu_ms", "extra_cpu_ms", "shaken_usual_m",
               "shaken_most_m", "shaken_middle_m", "settled_most_m", "settled_middle_m", "mesh_m",
               "rest_speed_mps"});
  for (const HeadCollision& head : study.head)
    csv.add_row({head.name, fmt::format("{}", head.resolution), csv_number(head.cell_m),
                 csv_number(head.load_ms), csv_number(head.step_cpu_ms), csv_number(head.extra_cpu_ms),
                 csv_number(head.shaken.vertex_usual_m), csv_number(head.shaken.vertex_most_m),
                 csv_number(head.shaken.middle_most_m), csv_number(head.settled.vertex_most_m),
                 csv_number(head.settled.middle_most_m), csv_number(head.mesh_m),
                 csv_number(head.rest_speed_mps)});
  return csv.text();
}

std::string body_answer_csv(const CollisionStudy& study) {
  CsvFile csv({"answer", "step_cpu_ms", "extra_cpu_ms", "usual_m", "most_m", "middle_m", "stretch",
               "rest_speed_mps", "carried_share"});
  for (const BodyAnswer& answer : study.body)
    csv.add_row({answer.name, csv_number(answer.step_cpu_ms), csv_number(answer.extra_cpu_ms),
                 csv_number(answer.depth.vertex_usual_m), csv_number(answer.depth.vertex_most_m),
                 csv_number(answer.depth.middle_most_m), csv_number(answer.stretch),
                 csv_number(answer.rest_speed_mps), csv_number(answer.carried_share)});
  return csv.text();
}

std::string head_collision_plot(const CollisionStudy& study) {
  PlotDesc plot;
  plot.title = "How deep hair gets in the head";
  plot.x = {"processor time over a step without the head, ms", PlotScale::Linear};
  plot.y = {"99.9 % of vertices, mm deep", PlotScale::Linear, 0.0};
  PlotSeries fields{"fields, coarse to fine", {}};
  for (const HeadCollision& head : study.head) {
    const PlotPoint point{head.extra_cpu_ms, 1e3 * head.shaken.vertex_usual_m, head.name};
    if (head.resolution > 0)
      fields.points.push_back(point);
    else
      plot.series.push_back({head.name, {point}, PlotMark::Dots});
  }
  plot.series.push_back(std::move(fields));
  return make_svg_plot(plot);
}

std::string body_answer_plot(const CollisionStudy& study) {
  PlotDesc plot;
  plot.title = "How deep hair gets in the body";
  plot.x = {"processor time over a step without the body, ms", PlotScale::Linear};
  plot.y = {"99.9 % of vertices, mm deep", PlotScale::Linear, 0.0};
  for (const BodyAnswer& answer : study.body)
    plot.series.push_back({answer.name,
                           {{answer.extra_cpu_ms, 1e3 * answer.depth.vertex_usual_m, answer.name}},
                           PlotMark::Dots});
  return make_svg_plot(plot);
}

std::string collision_page(const CollisionStudy& study) {
  HtmlPage page("Hair against head and body: depth against time");
  page.code(collision_summary(study));
  page.paragraph(fmt::format("{} on {}.", study.solver, study.device));
  add_head(page, study);
  add_body(page, study);
  return page.text();
}

Status save_collision_study(const CollisionStudy& study, const std::filesystem::path& folder) {
  RETURN_IF_ERROR(save_text(folder / "collisions_head.csv", head_collision_csv(study)));
  RETURN_IF_ERROR(save_text(folder / "collisions_body.csv", body_answer_csv(study)));
  RETURN_IF_ERROR(save_text(folder / "collisions_head.svg", head_collision_plot(study)));
  RETURN_IF_ERROR(save_text(folder / "collisions_body.svg", body_answer_plot(study)));
  return save_text(folder / kCollisionPage, collision_page(study));
}

}  // namespace strandcast
