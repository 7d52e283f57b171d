// SPDX-License-Identifier: Apache-2.0
#include "common/log/log.h"
#include "offload/body/template.h"
#include "offload/body/template_build.h"
#include "offload/body/template_check.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

struct TemplateFlags {
  std::string sources;
  std::string out;
  std::string file;
  TemplateBuildOptions build;
};

int build(const TemplateFlags& given) {
  TemplateBuildOptions options = given.build;
  options.progress = terminal_progress("template");
  const Result<BodyTemplate> body = build_template(given.sources, options);
  if (!body) return report_error(body.error());
  const Result<void> written = write_template(*body, given.out);
  return written ? 0 : report_error(written.error());
}

int check(const TemplateFlags& given) {
  const Result<BodyTemplate> body = find_template(given.file);
  if (!body) return report_error(body.error());
  bool sound = true;
  for (const TemplateFinding& finding : check_template(*body)) {
    std::printf("%s: %s\n", finding.is_error ? "fault" : "note", finding.what.c_str());
    sound = sound && !finding.is_error;
  }
  if (sound) std::printf("%s: no fault found\n", body->name.c_str());
  return sound ? 0 : 1;
}

int show(const TemplateFlags& given) {
  const Result<BodyTemplate> body = find_template(given.file);
  if (!body) return report_error(body.error());
  nlohmann::json parts = nlohmann::json::object();
  for (const TemplatePart& part : body->parts)
    parts[part.name] = {{"vertices", part.vertex_count}, {"triangles", part.triangle_count}};
  const nlohmann::json facts = {{"name", body->name},
                                {"checksum", body->checksum},
                                {"built_in", body->built_in},
                                {"vertices", body->mesh.vertices.size()},
                                {"triangles", body->mesh.triangles.size()},
                                {"joints", body->joints.size()},
                                {"body_components", body->shapes.size()},
                                {"head_components", body->head_shapes.size()},
                                {"expressions", body->expressions.size()},
                                {"landmarks", body->landmarks.size()},
                                {"parts", parts},
                                {"notices", body->notices}};
  std::printf("%s\n", facts.dump(2).c_str());
  return 0;
}

}  // namespace

void add_template_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<TemplateFlags>();
  CLI::App* verb = app.add_subcommand("template", "the human template");
  verb->require_subcommand(1);
  CLI::App* build_verb = verb->add_subcommand("build", "pack a template from its sources");
  build_verb->add_option("--sources", flags->sources, "folder of the template sources")
      ->required()
      ->check(CLI::ExistingDirectory);
  build_verb->add_option("--out", flags->out, "file to write (GLB)")->required();
  build_verb->add_option("--components", flags->build.components, "components of the body space")
      ->check(CLI::Range(1, 30))
      ->capture_default_str();
  build_verb->add_option("--head-modes", flags->build.head_modes, "modes of the face model in the head space")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  build_verb->callback([flags, &run] { run = [flags] { return build(*flags); }; });
  CLI::App* check_verb = verb->add_subcommand("check", "look for faults in a template");
  CLI::App* show_verb = verb->add_subcommand("show", "print what a template holds");
  for (CLI::App* one : {check_verb, show_verb}) {
    one->add_option("file", flags->file, "template (GLB); default: the one that would be used");
  }
  check_verb->callback([flags, &run] { run = [flags] { return check(*flags); }; });
  show_verb->callback([flags, &run] { run = [flags] { return show(*flags); }; });
}

}  // namespace gyre
