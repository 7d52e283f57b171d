// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "common/render/rasterise.h"
#include "offload/body/template.h"
#include "offload/report/camera_plot.h"
#include "offload/report/coverage_plot.h"
#include "offload/report/pictures.h"
#include "offload/report/report_facts.h"
#include "offload/report/report_page.h"
#include "offload/report/report_stage.h"
#include "offload/report/texture_sources.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

using nlohmann::json;

// The first tag that is closed wrongly or left open, or what else a parser would trip over; empty for a sound page.
std::string first_fault(const std::string& html) {
  static const std::set<std::string> single = {"meta", "img"};
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    if (html.compare(at, 2, "<!") == 0) continue;
    const std::size_t end = html.find('>', at);
    if (end == std::string::npos) return "tag without end at " + std::to_string(at);
    const std::string tag = html.substr(at + 1, end - at - 1);
    if (std::count(tag.begin(), tag.end(), '"') % 2 != 0 || tag.find('<') != std::string::npos)
      return "odd tag: " + tag.substr(0, 80);
    const bool closing = tag.starts_with('/');
    const std::string name = tag.substr(closing ? 1 : 0, tag.find_first_of(" /", 1) - (closing ? 1 : 0));
    if (closing) {
      const std::string wanted = tag.substr(1);
      if (open.empty() || open.back() != wanted) return "unexpected </" + wanted + ">";
      open.pop_back();
    } else if (!tag.ends_with('/') && !single.contains(name)) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "open <" + open.back() + ">";
}

class Report : public testing::Test {
 protected:
  void SetUp() override {
    scan.id = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
    scan.device = "rig <script>alert('x')</script> & \"co\"";
    scan.created = "2026-01-02T03:04:05Z";
    scan.passes = {{"body", 15, 40, 90, 160}, {"head", 15, 40, 90, 160}};
    const auto made = create_bundle(root / "bundle", scan);
    ASSERT_TRUE(made) << made.error().message();
    std::filesystem::create_directories(root / "out");
    const cv::Mat grey(160, 90, CV_8UC3, cv::Scalar(90, 120, 150));
    for (int i = 0; i < 12; ++i) cv::imwrite(bundle().frame(i < 8 ? "body" : "head", 3 * i).string(), grey);
  }

  Bundle bundle() const { return Bundle(root / "bundle"); }

  void add_stage(const char* name) const {
    std::filesystem::create_directories(bundle().work(name));
    const json record = {{"stage", name},
                         {"version", 3},
                         {"software", "0.1.0"},
                         {"seconds", 61.5},
                         {"cpu_seconds", 100.0},
                         {"peak_memory_mib", 512.0},
                         {"options", {{"note", "<b>&"}}},
                         {"result", json::object()}};
    ASSERT_TRUE(write_file(bundle().work(name) / "stage.json", record.dump()));
  }

  void add_cameras() const {
    add_stage("cameras");
    ColmapModel model;
    model.cameras[1] = Camera::from_fov(90, 160, 0.9);
    for (int i = 0; i < 11; ++i) {  // the last keyframe is not registered
      ModelImage image;
      image.name = frame_name(i < 8 ? "body" : "head", 3 * i);
      image.cam_from_world = look_at({2.2 * std::sin(0.5 * i), 1.4, 2.2 * std::cos(0.5 * i)}, {0, 1, 0});
      model.images[i + 1] = image;
    }
    ASSERT_TRUE(write_colmap_model(model, bundle().work("cameras")));
    ASSERT_TRUE(
        write_file(bundle().work("cameras") / "scene.json", R"({"scale_source":"assumed-height","height_mm":1700})"));
  }

  std::string make_page() const {
    StageContext context{bundle(), root / "out", report_stage().options};
    const auto done = report_stage().run(context);
    EXPECT_TRUE(done) << done.error().message();
    const auto html = read_file(root / "out" / "report.html");
    EXPECT_TRUE(html);
    return html ? *html : "";
  }

  json make_json() const {
    const auto text = read_file(root / "out" / "report.json");
    return text ? json::parse(*text) : json();
  }

  TemporaryFolder folder;
  const std::filesystem::path& root = folder.path();
  Scan scan;
};

TEST_F(Report, a_bare_scan_gives_a_sound_page_that_says_so) {
  const std::string html = make_page();
  EXPECT_EQ(first_fault(html), "");
  EXPECT_NE(html.find("Nothing has been reconstructed yet."), std::string::npos);
  const json report = make_json();
  EXPECT_EQ(report["keyframes"]["count"], 12);
  EXPECT_EQ(report["keyframes"]["registered"], 0);
  EXPECT_TRUE(report["fit"].is_null());
  EXPECT_TRUE(report["stages"].empty());
}

TEST_F(Report, names_from_outside_are_escaped_and_nothing_is_requested) {
  add_cameras();
  const std::string html = make_page();
  EXPECT_EQ(first_fault(html), "");
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("<b>&\""), std::string::npos);
  EXPECT_NE(html.find("rig &lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt; &amp; &quot;co&quot;"), std::string::npos);
  // Pictures are base 64, whose alphabet has the slash but neither colon, at sign nor parentheses.
  for (const char* request : {"http:", "https:", "@import", "<link", "<iframe"})
    EXPECT_EQ(html.find(request), std::string::npos) << request;
  EXPECT_EQ(html.find("src=\"h"), std::string::npos);
  EXPECT_EQ(html.find("href="), std::string::npos);
  EXPECT_EQ(html.find("url("), std::string::npos);
}

TEST_F(Report, shows_every_part_there_is) {
  add_cameras();
  for (const char* stage : {"cloud", "fit", "texture", "avatar"}) add_stage(stage);
  PointCloud cloud;
  for (int i = 0; i < 500; ++i)
    cloud.points.emplace_back(0.2f * std::sin(static_cast<float>(i)), 0.003f * static_cast<float>(i),
                              0.2f * std::cos(static_cast<float>(i)));
  ASSERT_TRUE(write_cloud(cloud, bundle().work("cloud") / "cloud.ply"));
  ASSERT_TRUE(write_file(bundle().work("cloud") / "cloud.json", R"({"points":500})"));
  TriangleMesh mesh;
  mesh.vertices = {{-0.3, 0, 0}, {0.3, 0, 0}, {0, 1.7, 0}};
  mesh.triangles = {{0, 1, 2}};
  ASSERT_TRUE(write_ply(mesh, bundle().work("fit") / "rest.ply"));
  ASSERT_TRUE(write_file(bundle().work("fit") / "fit.json",
                         R"({"template":{"name":"built-in","checksum":"x","built_in":true},"residual_mm":{"mean":6.25},
                             "yaw_deg":90,"stature_mm":1660,"warnings":["The feet were hardly seen."]})"));
  ASSERT_TRUE(write_file(bundle().work("avatar") / "avatar.glb", "glTF"));
  const std::string html = make_page();
  EXPECT_EQ(first_fault(html), "");
  for (const char* text :
       {"The avatar is ready.", "11 of 12 keyframes found their place.", "1.66 m tall", "within 6.2 mm", "5 min 8 s",
        "assumed", "built-in stand-in", "The feet were hardly seen.", "not placed", "<svg", "Point cloud", "512 MiB"})
    EXPECT_NE(html.find(text), std::string::npos) << text;
  const auto count = [&](const std::string& what) {
    int n = 0;
    for (std::size_t at = html.find(what); at != std::string::npos; at = html.find(what, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("<img src=\"data:image/jpeg;base64,"), 12 + 4 + 4);
  EXPECT_EQ(count("<title>body-") + count("<title>head-"), 2 * 11);  // each camera in both drawings
  const json report = make_json();
  EXPECT_EQ(report["stages"].size(), 5u);
  EXPECT_EQ(report["stages"][0]["stage"], "cameras");
  EXPECT_DOUBLE_EQ(report["seconds"], 5 * 61.5);
  EXPECT_EQ(report["avatar_bytes"], 4);
  EXPECT_EQ(report["warnings"].size(), 5u);  // few keyframes, unplaced, assumed height, built-in template, feet
}

TEST_F(Report, shows_where_the_texture_comes_from) {
  for (const char* stage : {"fit", "texture"}) add_stage(stage);
  const BodyTemplate body = built_in_template();
  ASSERT_TRUE(write_template(body, root / "template.glb"));
  ASSERT_TRUE(write_ply(body.mesh, bundle().work("fit") / "rest.ply"));
  ASSERT_TRUE(write_ply(body.mesh, bundle().work("fit") / "posed.ply"));
  const auto packed = read_template(root / "template.glb");
  ASSERT_TRUE(packed);
  ASSERT_TRUE(write_file(bundle().work("fit") / "fit.json",
                         json{{"template", {{"name", "x"}, {"checksum", packed->checksum}}}}.dump()));
  ASSERT_TRUE(write_file(bundle().work("texture") / "texture.json", R"({"share":{"within_45_deg":0.756},
      "origins":{"within_45_deg":2},"views":[{"name":"a","texels":4},{"name":"b","texels":0},{"name":"c","texels":1}]})"));
  for (const char* picture : {"albedo.png", "source.png"})
    cv::imwrite((bundle().work("texture") / picture).string(), cv::Mat(64, 64, CV_8UC3, cv::Scalar(10, 200, 10)));
  cv::imwrite((bundle().work("texture") / "origin.png").string(), cv::Mat(64, 64, CV_8U, cv::Scalar(2)));
  StageContext context{bundle(), root / "out", report_stage().options};
  context.options["template"] = (root / "template.glb").string();
  ASSERT_TRUE(report_stage().run(context));
  const std::string html = *read_file(root / "out" / "report.html");
  EXPECT_EQ(first_fault(html), "");
  for (const char* text :
       {"Where the texture comes from", "75.6 % photographs that look straight", "The 2 photographs"})
    EXPECT_NE(html.find(text), std::string::npos) << text;
}

TEST_F(Report, shows_the_end_of_a_failed_stages_log) {
  std::filesystem::create_directories(bundle().root() / "work");
  std::string log;
  for (int i = 0; i < 1000; ++i) log += "line " + std::to_string(i) + "\n";
  ASSERT_TRUE(write_file(bundle().work("fit.log"), log + "<b>out of memory\x1b\n"));
  const std::string html = make_page();
  EXPECT_EQ(first_fault(html), "");
  EXPECT_NE(html.find("The last that stage fit said"), std::string::npos);
  EXPECT_NE(html.find("&lt;b&gt;out of memory?"), std::string::npos);
  EXPECT_EQ(html.find("line 100\n"), std::string::npos);
}

TEST(texture_sources, each_number_gets_its_kinds_colour) {
  cv::Mat origin(1, 3, CV_8U, cv::Scalar(0));
  origin.at<std::uint8_t>(0, 1) = 7;
  origin.at<std::uint8_t>(0, 2) = 9;
  const json texture = {{"origins", {{"within_45_deg", 7}, {"filled", 9}, {"unheard_of", 0}, {"mirrored", 700}}}};
  const cv::Mat coloured = colour_origins(origin, texture);
  const auto colour_of = [](std::string_view name) {
    for (const OriginKind& kind : origin_kinds())
      if (kind.name == name) return cv::Vec3b(kind.colour[2], kind.colour[1], kind.colour[0]);
    return cv::Vec3b();
  };
  EXPECT_EQ(coloured.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(coloured.at<cv::Vec3b>(0, 1), colour_of("within_45_deg"));
  EXPECT_EQ(coloured.at<cv::Vec3b>(0, 2), colour_of("filled"));
  EXPECT_TRUE(colour_origins(origin, json()).empty());
  EXPECT_TRUE(colour_origins(cv::Mat(1, 1, CV_8UC3), texture).empty());
}

TEST_F(Report, says_in_words_what_the_scale_rests_on) {
  add_cameras();
  const auto summary_with = [&](const std::string& scene) {
    EXPECT_TRUE(write_file(bundle().work("cameras") / "scene.json", scene));
    const auto facts = collect_facts(bundle());
    EXPECT_TRUE(facts);
    return facts ? facts->summary : "";
  };
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(contains(summary_with(R"({"scale_source":"board","scale_uncertainty":0.0021,"height_mm":1700})"),
                       "All lengths rest on the printed board, to about 0.2 %."));
  EXPECT_TRUE(contains(summary_with(R"({"scale_source":"turntable-radius","scale_uncertainty":0.01})"),
                       "rest on the turntable's radius, to about 1.0 %."));
  EXPECT_TRUE(contains(summary_with(R"({"scale_source":"height"})"), "rest on the height given."));
  EXPECT_TRUE(contains(summary_with(R"({"scale_source":"assumed-height"})"), "rest on an assumed height."));
  EXPECT_FALSE(contains(summary_with(R"({"scale_source":7})"), "rest on"));
}

TEST_F(Report, a_measured_height_is_shown_and_compared_with_the_given_one) {
  add_cameras();
  const auto page_with = [&](double given) {
    scan.height_mm = given;
    EXPECT_TRUE(write_scan(bundle(), scan));
    EXPECT_TRUE(write_file(bundle().work("cameras") / "scene.json",
                           R"({"scale_source":"board","height_mm":1712.4,"height_uncertainty_mm":9})"));
    return make_page();
  };
  const std::string agrees = page_with(1700);
  EXPECT_EQ(first_fault(agrees), "");
  EXPECT_NE(agrees.find("Height measured <b>1712 \u00b1 9 mm</b>"), std::string::npos);
  EXPECT_EQ(agrees.find("do not agree"), std::string::npos);
  EXPECT_NE(page_with(1580).find("The height given, 1580 mm, and the one measured with the printed board, 1712 mm"),
            std::string::npos);
}

TEST_F(Report, a_pass_that_was_joined_by_shape_is_said_in_words) {
  add_cameras();
  ASSERT_TRUE(write_file(bundle().work("cameras") / "scene.json",
                         R"({"joined_by_shape":[{"pass":"head","views":50,"residual_mm":6.4,"overlap":0.9}]})"));
  const std::string page = make_page();
  EXPECT_NE(page.find("pass head show nothing that the others show as well"), std::string::npos);
  EXPECT_NE(page.find("about 6.4 mm"), std::string::npos);
}

TEST_F(Report, an_open_ring_is_said_in_words) {
  add_cameras();
  const auto page_with = [&](const char* scene) {
    EXPECT_TRUE(write_file(bundle().work("cameras") / "scene.json", scene));
    return make_page();
  };
  const std::string open = page_with(R"({"ring":{"closed":false,"covered_deg":268.4,"largest_gap_deg":91.6}})");
  EXPECT_EQ(first_fault(open), "");
  EXPECT_NE(open.find("the camera saw it from 268 of 360 degrees"), std::string::npos);
  EXPECT_NE(page_with(R"({"ring":{"closed":false,"covered_deg":345,"largest_gap_deg":15}})").find("is not closed"),
            std::string::npos);
  EXPECT_EQ(page_with(R"({"ring":{"closed":true,"covered_deg":360,"largest_gap_deg":15}})").find("The way around"),
            std::string::npos);
  EXPECT_EQ(page_with(R"({"ring":"all"})").find("The way around"), std::string::npos);
}

TEST_F(Report, damaged_parts_become_warnings) {
  add_cameras();
  add_stage("fit");
  ASSERT_TRUE(write_file(bundle().work("cameras") / "images.txt", "1 not a number"));
  ASSERT_TRUE(write_file(bundle().work("fit") / "fit.json", "[1, 2"));
  ASSERT_TRUE(write_file(bundle().work("fit") / "stage.json", R"({"seconds":"long","options":3})"));
  ASSERT_TRUE(write_file(bundle().frame("body", 0), "no picture"));
  EXPECT_EQ(first_fault(make_page()), "");
  EXPECT_GE(make_json()["warnings"].size(), 3u);
}

TEST_F(Report, a_camera_on_the_subjects_left_is_drawn_on_the_right) {
  add_cameras();
  auto facts = collect_facts(bundle());
  ASSERT_TRUE(facts);
  facts->model.images.clear();
  ModelImage image;
  image.name = frame_name("body", 0);
  image.cam_from_world = look_at({2, 1, 0}, {0, 1, 0});  // +X is the left of a subject that faces +Z
  facts->model.images[1] = image;
  EXPECT_NE(cameras_from_above(*facts).find("cx=\"334.00\" cy=\"180.00\""), std::string::npos);
  facts->fit = {{"yaw_deg", 90}};  // faces +X: the camera is in front
  EXPECT_NE(cameras_from_above(*facts).find("cx=\"180.00\" cy=\"334.00\""), std::string::npos);
}

// A coverage of ten bands and twelve sectors with the given holes.
json coverage_with(const json& holes) {
  json coverage = {{"bands", 10}, {"sectors", 12}, {"height_m", 1.7}, {"holes", holes}};
  coverage["crown"] = {{"points", 900}, {"views", 4}, {"median_angle_deg", 50}, {"median_std_mm", 1.5}};
  for (int i = 0; i < 120; ++i)
    coverage["cells"].push_back(
        {{"points", 100}, {"views", 5 + i / 12}, {"median_angle_deg", 30}, {"median_std_mm", 0.7}});
  return coverage;
}
json hole(int band, int sector, const char* kind, const char* side = "outer") {
  return {{"band", band}, {"sector", sector}, {"kind", kind}, {"side", side}};
}

std::vector<std::string> sentences_for(const json& coverage, const json& fit) {
  ReportFacts facts;
  facts.coverage = coverage;
  facts.fit = fit;
  return hole_sentences(facts);
}

using Strings = std::vector<std::string>;

TEST(coverage_plot, holes_are_named_as_a_person_would) {
  const json ahead = {{"yaw_deg", 0}};
  // Sector 3 lies towards +X, the left of a subject that faces +Z.
  const json knee = coverage_with(json::array({hole(2, 3, "not filmed")}));
  EXPECT_EQ(sentences_for(knee, ahead),
            Strings{"Left side, knee height: hardly seen; no picture looks at it squarely."});
  EXPECT_EQ(sentences_for(knee, {{"yaw_deg", 90}}),
            Strings{"Front, knee height: hardly seen; no picture looks at it squarely."});
  EXPECT_EQ(sentences_for(knee, nullptr),
            Strings{"The side at 90\u00b0, knee height: hardly seen; no picture looks at it squarely."});
  EXPECT_EQ(sentences_for(coverage_with(json::array({hole(3, 9, "not matched", "inner")})), ahead),
            Strings{"Right side, thigh height, what faces inwards: hardly seen, though pictures look at it (dark, "
                    "shiny or plain?)."});
  EXPECT_EQ(
      sentences_for(coverage_with(json::array({{{"crown", true}, {"kind", "not filmed"}, {"side", "outer"}}})), ahead),
      Strings{"The crown: hardly seen; no picture looks at it squarely."});
  EXPECT_EQ(sentences_for(coverage_with(json::array()), ahead), Strings());
}

TEST(coverage_plot, neighbouring_holes_are_one) {
  const json ahead = {{"yaw_deg", 0}};
  json holes;
  for (int band = 5; band < 8; ++band)
    for (const int sector : {11, 0, 1}) holes.push_back(hole(band, sector, "not filmed"));
  holes.push_back(hole(0, 6, "not filmed"));
  EXPECT_EQ(sentences_for(coverage_with(holes), ahead),
            (Strings{"Front right to front left, hip to chest height: hardly seen; no picture looks at it squarely.",
                     "Back, foot height: hardly seen; no picture looks at it squarely."}));
  json around;
  for (int sector = 0; sector < 12; ++sector) around.push_back(hole(1, sector, "not matched"));
  EXPECT_EQ(sentences_for(coverage_with(around), ahead),
            Strings{"All around, shin height: hardly seen, though pictures look at it (dark, shiny or plain?)."});
}

TEST(coverage_plot, a_file_without_sense_gives_nothing) {
  for (const json& wrong : {json(nullptr), json{{"bands", 10}}, json{{"bands", 1e300}, {"sectors", -1}},
                            json{{"bands", 2}, {"sectors", 12}, {"height_m", 1.7}, {"cells", {1, 2, 3}}}}) {
    ReportFacts facts;
    facts.coverage = wrong;
    EXPECT_EQ(coverage_grid(facts), "") << wrong.dump();
    EXPECT_TRUE(hole_sentences(facts).empty());
  }
  json odd = coverage_with({hole(99, 3, "not filmed"), hole(-1, 0, "x"), 7, "hole"});
  odd["cells"][5] = "no cell";
  EXPECT_TRUE(sentences_for(odd, {{"yaw_deg", 0}}).empty());
}

TEST_F(Report, shows_the_coverage_and_warns_of_holes) {
  add_cameras();
  add_stage("cloud");
  const json coverage = coverage_with(json::array({hole(2, 3, "not filmed")}));
  ASSERT_TRUE(write_file(bundle().work("cloud") / "coverage.json", coverage.dump()));
  const std::string html = make_page();
  EXPECT_EQ(first_fault(html), "");
  EXPECT_NE(html.find("Which side was seen at which height"), std::string::npos);
  EXPECT_NE(html.find("The side at 90\u00b0, knee height: hardly seen"), std::string::npos);
  EXPECT_NE(html.find("One place of the body was hardly seen"), std::string::npos);
  EXPECT_EQ(make_json()["holes"].size(), 1u);
}

TEST(report_page, html_is_escaped) {
  EXPECT_EQ(escape_html("a<b>&\"'c"), "a&lt;b&gt;&amp;&quot;&#39;c");
}

// RFC 4648, section 10.
TEST(pictures, base64_test_vectors) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(pictures, the_turnaround_starts_at_the_front_and_goes_to_the_left) {
  // A thin wall whose front is red; seen from its left and right there is (almost) nothing.
  TriangleMesh mesh;
  mesh.vertices = {{-0.3, 0, 0}, {0.3, 0, 0}, {0.3, 1.7, 0}, {-0.3, 1.7, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.colours.assign(4, Rgb(255, 0, 0));
  const auto pictures = render_turnaround(mesh, {}, 60, 90);
  const cv::Vec3b front = pictures[0].at<cv::Vec3b>(45, 30);
  EXPECT_GT(front[2], 100);
  EXPECT_EQ(front[0], 0);
  EXPECT_EQ(pictures[2].at<cv::Vec3b>(45, 30), cv::Vec3b(255, 255, 255));
}

TEST(pictures, a_cloud_is_seen_from_the_asked_side) {
  PointCloud cloud;
  for (int i = 0; i < 4000; ++i) {
    const float t = static_cast<float>(i % 200) / 200, y = static_cast<float>(i / 200) / 20;
    cloud.points.emplace_back(t - 0.5f, y, 0.2f);
    cloud.colours.emplace_back(255, 0, 0);
    cloud.points.emplace_back(t - 0.5f, y, -0.2f);
    cloud.colours.emplace_back(0, 0, 255);
  }
  EXPECT_GT(cv::mean(render_cloud(cloud, 0, 40, 60))[2], cv::mean(render_cloud(cloud, 0, 40, 60))[0] + 20);
  EXPECT_GT(cv::mean(render_cloud(cloud, M_PI, 40, 60))[0], cv::mean(render_cloud(cloud, M_PI, 40, 60))[2] + 20);
}

TEST(report_facts, durations_read_naturally) {
  EXPECT_EQ(duration_text(4.21), "4.2 s");
  EXPECT_EQ(duration_text(59.6), "1 min 0 s");
  EXPECT_EQ(duration_text(500), "8 min 20 s");
  EXPECT_EQ(duration_text(7300), "2 h 1 min");
}

}  // namespace
}  // namespace gyre
