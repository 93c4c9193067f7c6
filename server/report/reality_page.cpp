#include "server/report/hair_reality.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "common/plot/svg_plot.h"

namespace strandcast {
namespace {

/// A lean is right within this of the law's tangent.
constexpr double kLeanTolerance = 0.03;
/// Growth of sway per second below which it cannot be told from none.
constexpr double kGrowthPerS = 0.05;
/// Least lean of a lock, as a share of a solid cylinder's.
constexpr double kLeastSolidShare = 0.5;

std::string degrees_text(double angle_rad) {
  return fmt::format("{:.1f}", glm::degrees(angle_rad));
}

std::string share_text(double share) {
  return fmt::format("{:.0f} %", 100.0 * share);
}

std::string growth_text(double per_s) {
  return std::isfinite(per_s) ? fmt::format("{:+.2f}", per_s) : "too fast";
}

/// Relative error of the lean's tangent, which is force over weight.
double lean_off(const WindLean& lean) {
  return std::tan(lean.ours_rad) / std::tan(lean.law_rad) - 1.0;
}

void add_hairs(HtmlPage& page, const HairReality& reality) {
  page.heading("Reality: one hair in a steady wind");
  page.paragraph(
      "A limp hair that hangs in a steady wind is a straight line: drag and weight act alike all along it. "
      "Its lean has the tangent rate x wind / g, with the rate of the law that strands are dragged by. The "
      "last column is the lean of a thin cylinder by its published drag (Sucker and Brauer 1975), which the "
      "flow across it alone decides.");
  HtmlTable table{
      "",
      {"wind, m/s", "steps a second", "ours, degrees", "law, degrees", "force off by", "cylinder, degrees"},
      {}};
  for (const WindLean& lean : reality.hairs) {
    const double off = lean_off(lean);
    table.rows.push_back({fmt::format("{:g}", lean.wind_mps),
                          fmt::format("{:g}", lean.step_rate_hz),
                          degrees_text(lean.ours_rad),
                          degrees_text(lean.law_rad),
                          {fmt::format("{:+.1f} %", 100.0 * off),
                           std::abs(off) <= kLeanTolerance ? HtmlMark::Good : HtmlMark::Bad},
                          degrees_text(lean.cylinder_rad)});
  }
  page.table(table);
  page.paragraph(
      "The law takes the rate at the whole speed, the cylinder at the speed across; that is where the two "
      "part.");
}

void add_locks(HtmlPage& page, const HairReality& reality) {
  page.heading("Reality: a lock in a steady wind");
  page.paragraph(
      "400 limp strands stand for 40,000 hairs, 25 cm long and 6 cm wide at the roots. Hair in front "
      "shelters hair behind, so the lock leans far less than one of its hairs. A solid cylinder as wide and "
      "as heavy, with a drag coefficient of 1.1, is what a lock may not lean much less than.");
  HtmlTable table{"", {"wind, m/s", "ours, degrees", "one hair, degrees", "solid cylinder, degrees"}, {}};
  for (const LockLean& lean : reality.locks)
    table.rows.push_back({fmt::format("{:g}", lean.wind_mps),
                          fmt::format("{:.2f}", glm::degrees(lean.ours_rad)), degrees_text(lean.single_rad),
                          fmt::format("{:.2f}", glm::degrees(lean.solid_rad))});
  page.table(table);
  if (reality.locks.empty()) return;
  const LockLean& last = reality.locks.back();
  if (last.ours_rad >= kLeastSolidShare * last.solid_rad) return;
  page.paragraph(
      fmt::format("Ours is off here: at {:g} m/s it leans by {:.2f} degrees where a solid cylinder leans by "
                  "{:.2f}. Hair takes shelter behind the hair in front, and in the air that moves with it.",
                  last.wind_mps, glm::degrees(last.ours_rad), glm::degrees(last.solid_rad)));
}

void add_bundles(HtmlPage& page, const HairReality& reality) {
  page.heading("Reality: air that a bundle holds back");
  page.paragraph(fmt::format(
      "What a bundle of {:g} cm that stands still takes off the speed of a wind of 1 m/s, on the mean over "
      "the bundle. By ours, hair upwind lets a part of the wind through, and some of it goes around. "
      "Taylor's porous plate (1944) lets air through against a loss of pressure. Brinkman's layer (1949) "
      "lets momentum seep in by viscosity alone, from faces where the air moves. Drag is the mean of the "
      "bundle's hairs over that of a lone one, by ours.",
      100.0 * AirDesc().lock_width_m));
  HtmlTable table{"", {"hairs per cm2", "ours", "porous plate", "viscous layer", "drag of one hair"}, {}};
  PlotDesc plot;
  plot.title = "Air that a bundle of hairs holds back";
  plot.x = {"hairs per cm2"};
  plot.y = {"share of the wind", PlotScale::Linear, 0.0, 1.0};
  plot.height = 360.0;
  PlotSeries ours{"ours", {}}, screen{"porous plate", {}}, viscous{"viscous layer", {}};
  for (const BundleAir& bundle : reality.bundles) {
    table.rows.push_back({fmt::format("{:g}", bundle.hairs_per_cm2), share_text(bundle.ours),
                          share_text(bundle.screen), share_text(bundle.viscous),
                          fmt::format("{:.1f} %", 100.0 * bundle.drag_share)});
    ours.points.push_back({bundle.hairs_per_cm2, bundle.ours});
    screen.points.push_back({bundle.hairs_per_cm2, bundle.screen});
    viscous.points.push_back({bundle.hairs_per_cm2, bundle.viscous});
  }
  page.table(table);
  plot.series = {ours, screen, viscous};
  page.figure(make_svg_plot(plot), "Share of the wind that is held back against how many hairs there are.");
}

void add_ponytails(HtmlPage& page, const HairReality& reality) {
  page.heading("Reality: a jogger's ponytail");
  page.paragraph(
      "A head that goes straight up and down makes a ponytail sway sideways (Keller 2010). It has to beat "
      "about twice as often as the ponytail sways by itself; elsewhere sway dies away. Theory is the growth "
      "of that sway by Mathieu's equation, with the frequency and the decay of our own free sway.");
  for (const Ponytail& tail : reality.ponytails) {
    page.paragraph(
        fmt::format("{}: it sways {:.2f} times a second by itself (a limp chain: {:.2f}). Its amplitude "
                    "decays by a rate of {:.2f} per second. The head's acceleration is {:g} g.",
                    tail.name, tail.sway_radps / (2.0 * std::numbers::pi),
                    tail.chain_radps / (2.0 * std::numbers::pi), tail.decay_per_s, tail.modulation));
    HtmlTable table{"", {"over twice its own", "head, Hz", "growth per s, ours", "theory", "sways"}, {}};
    for (const PonytailSway& row : tail.rows) {
      const bool grows = !(row.ours_per_s < kGrowthPerS);
      table.rows.push_back({fmt::format("{:g}", row.ratio),
                            fmt::format("{:.2f}", row.head_hz),
                            growth_text(row.ours_per_s),
                            growth_text(row.theory_per_s),
                            {grows ? "yes" : "no",
                             grows == (row.theory_per_s > kGrowthPerS) ? HtmlMark::Good : HtmlMark::Bad}});
    }
    page.table(table);
  }
  page.paragraph(
      "A limp ponytail of 20 cm sways 1.34 times a second, and a jogger's head goes up and down 2.5 to 3 "
      "times. The shape of a ponytail at rest (Goldstein, Warren and Ball 2012) is not held here. It follows "
      "from the random curls of its hairs, and strands that stand for many hairs have none of those.");
}

}  // namespace

std::string reality_text(const HairReality& reality) {
  std::string text;
  for (const WindLean& lean : reality.hairs)
    text += fmt::format(
        "one hair, wind {:g} m/s, {:4g} Hz: leans {:.1f} degrees, law {:.1f} (force {:+.1f} %), cylinder "
        "{:.1f}\n",
        lean.wind_mps, lean.step_rate_hz, glm::degrees(lean.ours_rad), glm::degrees(lean.law_rad),
        100.0 * lean_off(lean), glm::degrees(lean.cylinder_rad));
  for (const LockLean& lean : reality.locks)
    text +=
        fmt::format("a lock, wind {:g} m/s: leans {:.2f} degrees, one hair {:.1f}, a solid cylinder {:.2f}\n",
                    lean.wind_mps, glm::degrees(lean.ours_rad), glm::degrees(lean.single_rad),
                    glm::degrees(lean.solid_rad));
  for (const BundleAir& bundle : reality.bundles)
    text += fmt::format("{:g} hairs/cm2: {} of the wind is held back (porous plate {}, viscous layer {})\n",
                        bundle.hairs_per_cm2, share_text(bundle.ours), share_text(bundle.screen),
                        share_text(bundle.viscous));
  for (const Ponytail& tail : reality.ponytails)
    for (const PonytailSway& row : tail.rows)
      text += fmt::format("{}: head at {:g} x twice its own {:.2f} Hz: sway grows by {}/s, theory {}\n",
                          tail.name, row.ratio, tail.sway_radps / (2.0 * std::numbers::pi),
                          growth_text(row.ours_per_s), growth_text(row.theory_per_s));
  return text;
}

void add_reality(HtmlPage& page, const HairReality& reality) {
  add_hairs(page, reality);
  add_locks(page, reality);
  add_bundles(page, reality);
  add_ponytails(page, reality);
}

}  // namespace strandcast
