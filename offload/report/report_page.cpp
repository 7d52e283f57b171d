// SPDX-License-Identifier: Apache-2.0
#include "offload/report/report_page.h"

#include "offload/report/camera_plot.h"
#include "offload/report/coverage_plot.h"
#include "offload/report/json_fields.h"
#include "offload/report/landmark_words.h"
#include "offload/report/texture_sources.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

constexpr const char* style = R"css(
:root{--ink:#1d2430;--soft:#667080;--line:#e2e5ea;--paper:#fff;--ground:#f6f7f9;--accent:#2f6690;--amber:#8a5a00;--amber-ground:#fff6e2}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif}
main{max-width:68rem;margin:0 auto;padding:2.5rem 1.25rem 4rem}
header p.summary{font-size:1.25rem;line-height:1.5;max-width:46rem;margin:.4rem 0 1rem}
h1{font-size:1.05rem;font-weight:600;margin:0;color:var(--soft);letter-spacing:.01em}
h2{font-size:1.05rem;margin:0 0 1rem}
section{background:var(--paper);border:1px solid var(--line);border-radius:12px;padding:1.4rem 1.5rem;margin-top:1.25rem}
.facts{display:flex;flex-wrap:wrap;gap:.35rem 1.6rem;color:var(--soft);font-size:.9rem;margin:0}
.facts b{color:var(--ink);font-weight:600}
ul.warnings{list-style:none;margin:1.2rem 0 0;padding:0}
ul.warnings li{background:var(--amber-ground);color:var(--amber);border-left:4px solid #e0a526;border-radius:6px;padding:.55rem .9rem;margin-top:.5rem}
.row{display:grid;gap:1rem}
.four{grid-template-columns:repeat(4,1fr)}
.two{grid-template-columns:repeat(auto-fit,minmax(17rem,1fr))}
figure{margin:0;text-align:center;color:var(--soft);font-size:.85rem}
figure img,figure svg{width:100%;height:auto;display:block}
figcaption{margin-top:.3rem}
svg .grid{fill:none;stroke:#e2e5ea}
svg .subject{fill:#cbd2db}
svg .cell{stroke:none}
svg .hole{fill:none;stroke:#c8553d;stroke-width:1.6}
svg text{font-size:10px;fill:#8a93a1;font-family:inherit}
.legend{display:flex;flex-wrap:wrap;list-style:none;padding:0;gap:1.2rem;font-size:.85rem;color:var(--soft);margin:.8rem 0 0}
.dot{display:inline-block;width:.65em;height:.65em;border-radius:50%;margin-right:.4em}
.sheet{display:grid;grid-template-columns:repeat(auto-fill,minmax(4.6rem,1fr));gap:.5rem}
.sheet figure{font-size:.7rem;line-height:1.25}
.sheet img{border-radius:4px;border-bottom:3px solid var(--pass)}
.sheet .out img{opacity:.35}
h3{font-size:.85rem;font-weight:600;color:var(--soft);margin:1.2rem 0 .5rem}
h3:first-of-type{margin-top:0}
table{border-collapse:collapse;width:100%;font-size:.92rem;font-variant-numeric:tabular-nums}
th{font-weight:600;color:var(--soft);text-align:left;font-size:.82rem}
td,th{padding:.42rem .6rem .42rem 0;border-bottom:1px solid var(--line);vertical-align:middle}
td.number,th.number{text-align:right}
tr:last-child td{border-bottom:0}
tr.total td{font-weight:600}
.bar{background:var(--accent);height:.6rem;border-radius:3px;min-width:2px}
.compare{position:relative}
.compare img.over{position:absolute;inset:0;clip-path:inset(0 0 0 var(--at,50%))}
.compare input{position:absolute;left:0;bottom:.5rem;width:100%;margin:0;accent-color:var(--accent);opacity:.85}
.scale{height:.7rem;border-radius:3px;margin-top:1rem;background:linear-gradient(90deg,#fffff5,#fed976,#fd8d3c,#bd0026,#280014);border:1px solid var(--line)}
.ends{display:flex;justify-content:space-between;color:var(--soft);font-size:.8rem}
details{margin-top:.6rem}
summary{cursor:pointer;color:var(--soft);font-size:.9rem}
pre{font-size:.78rem;line-height:1.45;background:var(--ground);border-radius:8px;padding:.8rem 1rem;overflow:auto;white-space:pre-wrap}
footer{color:var(--soft);font-size:.8rem;margin-top:1.5rem}
@media(max-width:40rem){.four{grid-template-columns:repeat(2,1fr)}}
@media print{body{background:#fff;font-size:11pt}main{max-width:none;padding:0}section{border:0;padding:.6rem 0;break-inside:avoid}.compare input{display:none}.sheet figure{break-inside:avoid}details{display:none}}
)css";

// Moves the border between photograph and avatar. The page says all it has to say without it.
constexpr const char* script = R"js(
document.querySelectorAll('.compare').forEach(function (pair) {
  var slider = pair.querySelector('input');
  function move() { pair.style.setProperty('--at', slider.value + '%'); }
  slider.addEventListener('input', move);
  move();
});
)js";

std::string picture(const std::string& uri, const std::string& caption) {
  if (uri.empty()) return {};
  return fmt::format("<figure><img src=\"{}\" alt=\"{}\"><figcaption>{}</figcaption></figure>", uri,
                     escape_html(caption), escape_html(caption));
}

std::string header(const ReportFacts& facts) {
  const Scan& scan = facts.scan;
  std::string html = fmt::format("<header><h1>Scan {}</h1><p class=\"summary\">{}</p><p class=\"facts\">",
                                 escape_html(scan.id), escape_html(facts.summary));
  const auto fact = [&](const char* name, const std::string& value) {
    if (!value.empty()) html += fmt::format("<span>{} <b>{}</b></span>", name, escape_html(value));
  };
  fact("Device", scan.device);
  fact("Taken", scan.created);
  fact("Mode", scan.mode);
  fact("Height given", scan.height_mm ? fmt::format("{:.0f} mm", *scan.height_mm) : "no");
  const std::string source = text_at(facts.scene, "/scale_source");
  if (source == "board" || source == "turntable-radius")
    fact("Height measured", fmt::format("{:.0f} \u00b1 {:.0f} mm", number_at(facts.scene, "/height_mm", 0),
                                        number_at(facts.scene, "/height_uncertainty_mm", 0)));
  fact("Template", text_at(facts.fit, "/template/name"));
  if (facts.avatar_bytes > 0) fact("Avatar", fmt::format("{:.1f} MB", static_cast<double>(facts.avatar_bytes) / 1e6));
  html += "</p>";
  if (!facts.warnings.empty()) {
    html += "<ul class=\"warnings\">";
    for (const std::string& warning : facts.warnings) html += "<li>" + escape_html(warning) + "</li>";
    html += "</ul>";
  }
  return html + "</header>";
}

std::string four_sides(const std::string& title, const std::array<std::string, 4>& uris) {
  if (std::all_of(uris.begin(), uris.end(), [](const std::string& uri) { return uri.empty(); })) return {};
  static constexpr const char* captions[] = {"front", "its left", "back", "its right"};
  std::string html = "<section><h2>" + escape_html(title) + "</h2><div class=\"row four\">";
  for (std::size_t i = 0; i < 4; ++i) html += picture(uris[i], captions[i]);
  return html + "</div></section>";
}

std::string overlay_section(const ReportPictures& pictures) {
  if (pictures.overlays.empty()) return {};
  std::string html = "<section><h2>Photographs, and the avatar in its place</h2><div class=\"row four\">";
  for (const OverlayPicture& o : pictures.overlays) {
    const std::string caption = escape_html(o.caption);
    html += fmt::format(
        "<figure><div class=\"compare\"><img src=\"{}\" alt=\"photograph {}\"><img class=\"over\" src=\"{}\" "
        "alt=\"the avatar in {}\"><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"share of the "
        "photograph in {}, percent\" /></div><figcaption>{}</figcaption></figure>",
        o.photo, caption, o.avatar, caption, caption, caption);
  }
  return html +
         "</div><p class=\"legend\">The photograph is on the left of the slider, the avatar on the "
         "right.</p></section>";
}

std::string distance_section(const ReportPictures& pictures) {
  std::string html = four_sides("How far the surface is from the cloud", pictures.distance);
  if (html.empty()) return {};
  html.resize(html.size() - std::string("</section>").size());
  return html +
         fmt::format(
             "<div class=\"scale\"></div><div class=\"ends\"><span>0 mm</span><span>{:.0f} mm</span><span>{:.0f} mm "
             "and more</span></div><p class=\"legend\">Grey: no cloud there, so the surface is the template's.</p>"
             "</section>",
             heat_limit_mm / 2, heat_limit_mm);
}

std::string source_section(const ReportFacts& facts, const ReportPictures& pictures) {
  std::string html = four_sides("Where the texture comes from", pictures.origins);
  if (html.empty()) return {};
  html.resize(html.size() - std::string("</section>").size());
  html += "<ul class=\"legend\">";
  for (const OriginKind& kind : origin_kinds()) {
    const double share = number_at(facts.texture, (std::string("/share/") + kind.name).c_str(), 0);
    html += fmt::format("<li><span class=\"dot\" style=\"background:rgb({},{},{})\"></span>{:.1f} % {}</li>",
                        kind.colour[0], kind.colour[1], kind.colour[2], 100 * share, kind.words);
  }
  html += "</ul></section>";
  const nlohmann::json views =
      facts.texture.is_object() ? facts.texture.value("views", nlohmann::json::array()) : nlohmann::json::array();
  const auto used = std::count_if(views.begin(), views.end(),
                                  [](const nlohmann::json& view) { return number_at(view, "/texels", 0) > 0; });
  const std::string by_view =
      four_sides(fmt::format("The {} photographs in the texture, each in a colour of its own", used), pictures.views);
  return html + "\n" + by_view;
}

std::string cloud_title(const ReportFacts& facts) {
  const double points = number_at(facts.cloud, "/points", 0);
  return points > 0 ? fmt::format("Point cloud of {:.0f} thousand points", points / 1000) : "Point cloud";
}

std::string camera_section(const ReportFacts& facts) {
  const std::string above = cameras_from_above(facts);
  if (above.empty()) return {};
  std::string html = "<section><h2>Where the camera stood</h2><div class=\"row two\"><figure>" + above +
                     "<figcaption>from above; the subject faces down</figcaption></figure><figure>" +
                     cameras_from_side(facts) +
                     "<figcaption>from the side: height over distance</figcaption></figure></div><p class=\"legend\">";
  std::map<std::string, int> passes;
  for (const auto& [id, image] : facts.model.images)
    if (const auto name = parse_frame_name(image.name)) ++passes[name->pass];
  for (const auto& [pass, count] : passes)
    html += fmt::format("<span><span class=\"dot\" style=\"background:{}\"></span>pass {}: {} cameras</span>",
                        pass_colour(pass), escape_html(pass), count);
  return html + "</p></section>";
}

std::string coverage_section(const ReportFacts& facts) {
  const std::string grid = coverage_grid(facts);
  if (grid.empty()) return {};
  std::string html = "<section><h2>Which side was seen at which height</h2><figure>" + grid +
                     "<figcaption>the surface unrolled: views that see each part</figcaption></figure>";
  const std::vector<std::string> holes = hole_sentences(facts);
  if (holes.empty()) return html + "<p>No side was missed.</p></section>";
  html += "<ul>";
  for (const std::string& hole : holes) html += "<li>" + escape_html(hole) + "</li>";
  return html + "</ul></section>";
}

std::string landmark_section(const ReportFacts& facts) {
  if (!facts.landmarks) return {};
  std::string html = "<section><h2>Landmarks</h2><ul>";
  for (const std::string& sentence : landmark_sentences(*facts.landmarks))
    html += "<li>" + escape_html(sentence) + "</li>";
  return html + "</ul></section>";
}

std::string keyframe_section(const ReportFacts& facts, const ReportPictures& pictures) {
  if (facts.keyframes.empty()) return {};
  std::string html = fmt::format("<section><h2>{} keyframes</h2>", facts.keyframes.size());
  std::string pass;
  for (std::size_t i = 0; i < facts.keyframes.size(); ++i) {
    const FrameId& frame = facts.keyframes[i];
    if (frame.pass != pass) {
      html += fmt::format("{}<h3>Pass {}</h3><div class=\"sheet\" style=\"--pass:{}\">", pass.empty() ? "" : "</div>",
                          escape_html(frame.pass), pass_colour(frame.pass));
      pass = frame.pass;
    }
    const ModelImage* image = facts.image(frame);
    std::string place = facts.model.images.empty() ? "" : "not placed";
    if (image != nullptr) {
      const Eigen::Vector3d c = centre_of(image->cam_from_world);
      const double azimuth = std::remainder(std::atan2(c.x(), c.z()) - facts.facing(), 2 * M_PI) * 180 / M_PI;
      place = fmt::format("{:+.0f}\u00b0", azimuth);
    }
    const std::string uri = i < pictures.keyframes.size() ? pictures.keyframes[i] : std::string();
    html += fmt::format(
        "<figure{} title=\"{}\"><img src=\"{}\" alt=\"keyframe {}\"><figcaption>{} \u00b7 "
        "{}</figcaption></figure>",
        image == nullptr && !facts.model.images.empty() ? " class=\"out\"" : "", escape_html(facts.reasons[i]), uri,
        frame.index, frame.index, place);
  }
  html += "</div>";
  if (std::any_of(facts.reasons.begin(), facts.reasons.end(), [](const std::string& r) { return !r.empty(); })) {
    html += "<details><summary>Why each of them was kept</summary><pre>";
    for (std::size_t i = 0; i < facts.keyframes.size(); ++i)
      html += fmt::format("{} {}: {}\n", escape_html(facts.keyframes[i].pass), facts.keyframes[i].index,
                          escape_html(facts.reasons[i]));
    html += "</pre></details>";
  }
  return html + "</section>";
}

// Nothing when no body was fitted.
std::string measure_section(const ReportFacts& facts) {
  const auto measures = facts.fit.is_object() ? facts.fit.find("measures") : facts.fit.end();
  if (!facts.fit.is_object() || measures == facts.fit.end() || !measures->is_object()) return {};
  static const std::vector<std::pair<const char*, const char*>> names = {
      {"stature", "Stature, floor to top of the hair"},
      {"stature_without_hair", "Stature without hair, estimated"},
      {"chest", "Chest"},
      {"waist", "Waist"},
      {"hip", "Hip"},
      {"inseam", "Inseam"},
      {"left_arm", "Left arm, shoulder to wrist"},
      {"right_arm", "Right arm, shoulder to wrist"}};
  std::string rows;
  for (const auto& [key, name] : names) {
    if (!measures->contains(key)) continue;
    const nlohmann::json& measure = (*measures)[key];
    const double value = number_at(measure, "/mm", -1), deviation = number_at(measure, "/deviation_mm", 0);
    if (value < 0) continue;
    rows += fmt::format("<tr><td>{}</td><td class=\"number\">{:.0f} mm</td><td class=\"number\">± {:.0f} mm</td></tr>",
                        name, value, deviation);
  }
  if (rows.empty()) return {};
  return "<section><h2>Measures</h2><table><tbody>" + rows +
         "</tbody></table><p>Over clothes and shoes; with the standard deviation that cloud, scale and what was not "
         "seen leave.</p></section>\n";
}

std::string stage_section(const ReportFacts& facts) {
  if (facts.stages.empty()) return {};
  double total = 0, cpu = 0, memory = 0, longest = 1e-9;
  for (const StageFacts& stage : facts.stages) {
    total += stage.seconds;
    cpu += stage.cpu_seconds;
    memory = std::max(memory, stage.peak_memory_mib);
    longest = std::max(longest, stage.seconds);
  }
  std::string html =
      "<section><h2>Time and memory</h2><table><thead><tr><th>stage</th><th style=\"width:45%\"></th><th "
      "class=\"number\">time</th>"
      "<th class=\"number\">processor</th><th class=\"number\">peak memory</th></tr></thead><tbody>";
  for (const StageFacts& stage : facts.stages)
    html += fmt::format(
        "<tr><td>{}</td><td><div class=\"bar\" style=\"width:{:.1f}%\"></div></td><td class=\"number\">{}</td>"
        "<td class=\"number\">{}</td><td class=\"number\">{:.0f} MiB</td></tr>",
        escape_html(stage.name), 100 * stage.seconds / longest, duration_text(stage.seconds),
        duration_text(stage.cpu_seconds), stage.peak_memory_mib);
  html += fmt::format(
      "<tr class=\"total\"><td>all</td><td></td><td class=\"number\">{}</td><td class=\"number\">{}</td>"
      "<td class=\"number\">{:.0f} MiB</td></tr></tbody></table>",
      duration_text(total), duration_text(cpu), memory);
  for (const StageFacts& stage : facts.stages)
    html += fmt::format("<details><summary>{}: version {}, options and result</summary><pre>{}</pre></details>",
                        escape_html(stage.name), stage.version,
                        escape_html(nlohmann::json{{"options", stage.options}, {"result", stage.result}}.dump(2)));
  return html + "</section>";
}

std::string failure_section(const ReportFacts& facts) {
  if (facts.failed.empty()) return {};
  std::string html = "<section><h2>What went wrong</h2>";
  for (const FailedStage& stage : facts.failed)
    html += fmt::format("<h3>The last that stage {} said</h3><pre>{}</pre>", escape_html(stage.name),
                        escape_html(stage.log));
  return html + "</section>";
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string report_page(const ReportFacts& facts, const ReportPictures& pictures) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>Scan " +
         escape_html(facts.scan.id) + "</title><style>" + style + "</style></head>\n<body><main>\n" + header(facts) +
         "\n" + four_sides("Avatar", pictures.avatar) + "\n" + overlay_section(pictures) + "\n" +
         distance_section(pictures) + "\n" + source_section(facts, pictures) + "\n" +
         four_sides(cloud_title(facts), pictures.cloud) + "\n" + measure_section(facts) + camera_section(facts) + "\n" +
         coverage_section(facts) + "\n" + landmark_section(facts) + "\n" + keyframe_section(facts, pictures) + "\n" +
         stage_section(facts) + "\n" + failure_section(facts) + "\n<footer>Gyre " + escape_html(GYRE_VERSION) +
         "</footer>\n</main>" +
         (pictures.overlays.empty() ? std::string() : "<script>" + std::string(script) + "</script>") +
         "</body></html>\n";
}

}  // namespace gyre
