#include <fmt/ranges.h>

#include <algorithm>

#include "core/version.h"
#include "limber/detail/batch/batch.h"
#include "limber/detail/body/preview.h"
#include "limber/detail/report/page.h"

namespace limber::detail {

// The files of report/, made part of the library by cmake/limber_embed.cmake.
extern const char* const batch_css;

namespace {

constexpr std::size_t models_a_page = 1000;

std::string file_of_page(std::size_t page) {
  return page == 0 ? "index.html" : fmt::format("index-{}.html", page + 1);
}

// What can be said of a row in two lines.
std::string figures_of(const BatchRow& row) {
  std::vector<std::string> words{fmt::format("{} triangles", row.triangles.value())};
  if (row.shells)
    words.push_back(fmt::format("{} shell{}, overshoot {:.1f} %", *row.shells, *row.shells == 1 ? "" : "s",
                                100 * row.max_overshoot.value()));
  if (row.tets) {
    const double ratio = row.volume_ratio.value();
    words.push_back(fmt::format("{} tets{}", *row.tets,
                                ratio > 0 ? fmt::format(", {:.2f} times the volume", ratio) : ""));
    words.push_back(row.certificate_holds.value()
                        ? "<span class=\"kept\">certificate holds</span>"
                        : fmt::format("<span class=\"broken\">certificate: {} vertices outside, {} triangles "
                                      "cross</span>",
                                      row.vertices_outside.value(), row.triangles_crossing.value()));
  }
  return fmt::format("{}", fmt::join(words, "<br>"));
}

void add_card(Page& page, const fs::path& batch, const BatchModel& model) {
  const BatchRow row = row_of(batch, model);
  page.add(
      "<div class=\"card model\"><img loading=\"lazy\" decoding=\"async\" width=\"320\" height=\"240\" "
      "alt=\"\" src=\"data:image/png;base64,{}\">\n<h3>{}</h3>\n<p>{}</p></div>\n",
      base64(read_file(folder_of(batch, model) / picture_file)), escaped(model.model.name), figures_of(row));
}

void add_failures(Page& page, const std::vector<const BatchModel*>& failed) {
  page.add(
      "<h2>Failed</h2>\n<div class=\"card wide failed\"><table>\n"
      "<tr><th>reason</th><th>model</th><th>what limber says</th></tr>\n");
  for (const BatchModel* model : failed)
    page.add("<tr><td>{}</td><td title=\"{}\">{}</td><td>{}</td></tr>\n", escaped(model->reason),
             escaped(model->model.file.string()), escaped(model->model.name), escaped(model->message));
  page.add("</table></div>\n");
}

void add_links(Page& page, std::size_t here, std::size_t pages) {
  if (pages == 1) return;
  page.add("<p class=\"lead\">");
  for (std::size_t other = 0; other < pages; ++other)
    if (other == here)
      page.add("{} ", other + 1);
    else
      page.add("<a href=\"{}\">{}</a> ", file_of_page(other), other + 1);
  page.add("</p>\n");
}

}  // namespace

void write_pages(const fs::path& batch, const std::vector<BatchModel>& models) {
  std::vector<const BatchModel*> done, failed;
  std::map<std::string, int> reasons;
  for (const BatchModel& model : models) {
    (model.reason.empty() ? done : failed).push_back(&model);
    if (!model.reason.empty()) ++reasons[model.reason];
  }
  std::stable_sort(failed.begin(), failed.end(),
                   [](const BatchModel* a, const BatchModel* b) { return a->reason < b->reason; });
  std::string lead = fmt::format("{} models, {} done, {} failed", models.size(), done.size(), failed.size());
  for (const auto& [reason, number] : reasons) lead += fmt::format(" · {} {}", number, reason);

  const std::size_t pages = std::max<std::size_t>(1, (done.size() + models_a_page - 1) / models_a_page);
  for (std::size_t p = 0; p < pages; ++p) {
    Page page;
    page.begin("limber prepare", "limber prepare", lead);
    page.add("<style>{}</style>\n", batch_css);
    add_links(page, p, pages);
    if (p == 0 && !failed.empty()) add_failures(page, failed);
    page.add("<h2>Done</h2>\n<div class=\"models\">\n");
    for (std::size_t i = p * models_a_page; i < std::min(done.size(), (p + 1) * models_a_page); ++i)
      add_card(page, batch, *done[i]);
    page.add("</div>\n");
    add_links(page, p, pages);
    page.add("<p class=\"note\">Made by limber {}.</p>\n</main>\n</body>\n</html>\n", version);
    write_file(batch / file_of_page(p), page.html());
  }
  for (std::size_t p = pages; fs::remove(batch / file_of_page(p)); ++p) {
  }
}

}  // namespace limber::detail
