//! Reads the files of `src` with `syn` and collects the facts for the checks: paths, macros, strings, functions.

use proc_macro2::{TokenStream, TokenTree};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Attribute, Block, ImplItem, Item, ItemMod, Macro, Signature, TraitItem, UseTree};

/// A line and the path that stands there.
pub(crate) type Use = (usize, Vec<String>);

/// One file of `src`.
#[derive(Default)]
pub(crate) struct Source {
    /// Relative to `src`.
    pub(crate) file: String,
    /// `["cli", "args"]` for `cli/args.rs`; `["main"]` for `main.rs`, nothing for `lib.rs`.
    module: Vec<String>,
    pub(crate) lines: usize,
    paths: Vec<Use>,
    /// Line and name of each macro that is called.
    pub(crate) macros: Vec<(usize, String)>,
    /// Line and content of each string, documentation excluded.
    pub(crate) texts: Vec<(usize, String)>,
    /// Line, name and number of lines of each function.
    pub(crate) functions: Vec<(usize, String, usize)>,
    /// Line, last name of the receiver (empty if unknown) and name of each method that is called.
    pub(crate) calls: Vec<(usize, String, String)>,
    /// The lines with `unsafe`.
    pub(crate) unsafes: Vec<usize>,
    /// Files or folders of modules under `#[cfg(test)]`, relative to `src`, without extension.
    pub(crate) test_files: Vec<String>,
}

impl Source {
    pub(crate) fn parse(file: &str, text: &str) -> Source {
        let stem = file.trim_end_matches(".rs");
        let stem = stem.strip_suffix("/mod").unwrap_or(stem);
        let module = stem.split('/').filter(|part| *part != "lib").map(str::to_owned).collect();
        let mut source = Source { file: file.to_owned(), module, lines: text.lines().count(), ..Source::default() };
        let parsed = syn::parse_file(text).unwrap_or_else(|error| panic!("src/{file}: {error}"));
        source.visit_file(&parsed);
        source
    }

    pub(crate) fn layer(&self) -> &str {
        self.module.first().map_or("lib", String::as_str)
    }

    /// The paths inside the crate, from its root on and without `crate`.
    pub(crate) fn inner_paths(&self) -> Vec<Use> {
        let inner = |(line, path): &Use| {
            let supers = path.iter().take_while(|part| *part == "super").count();
            match path[0].as_str() {
                "crate" | "cangauge" => Some((*line, path[1..].to_vec())),
                "super" => {
                    let kept = self.module.len().saturating_sub(supers);
                    Some((*line, self.module[..kept].iter().chain(&path[supers..]).cloned().collect()))
                }
                _ => None,
            }
        };
        self.paths.iter().filter_map(inner).collect()
    }

    /// The other paths.
    pub(crate) fn outer_paths(&self) -> impl Iterator<Item = &Use> {
        self.paths.iter().filter(|(_, path)| !["crate", "cangauge", "super"].contains(&path[0].as_str()))
    }

    /// The lines of paths such as `Format::Json`: one of `names` after `of`.
    pub(crate) fn paths_ending(&self, names: &'static [&str], of: &'static str) -> impl Iterator<Item = usize> {
        let is_one =
            move |path: &[String]| matches!(path, [.., first, last] if first == of && names.contains(&last.as_str()));
        self.paths.iter().filter(move |(_, path)| is_one(path)).map(|(line, _)| *line)
    }

    fn add_use(&mut self, tree: &UseTree, before: &[String]) {
        let with = |name: &dyn ToString| before.iter().cloned().chain([name.to_string()]).collect::<Vec<_>>();
        match tree {
            UseTree::Path(path) => self.add_use(&path.tree, &with(&path.ident)),
            UseTree::Name(name) => self.paths.push((line(name), with(&name.ident))),
            UseTree::Rename(rename) => self.paths.push((line(rename), with(&rename.ident))),
            UseTree::Glob(glob) => self.paths.push((line(glob), with(&"*"))),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.add_use(tree, before)),
        }
    }

    /// Collects from the inside of a macro or an attribute, which `syn` does not parse.
    fn add_tokens(&mut self, tokens: &TokenStream) {
        let tokens: Vec<TokenTree> = tokens.clone().into_iter().collect();
        let is =
            |at: usize, sign: char| matches!(tokens.get(at), Some(TokenTree::Punct(punct)) if punct.as_char() == sign);
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            at += 1;
            match token {
                TokenTree::Group(group) => self.add_tokens(&group.stream()),
                TokenTree::Literal(literal) => {
                    if let Ok(text) = syn::parse_str::<syn::LitStr>(&literal.to_string()) {
                        self.texts.push((line(literal), text.value()));
                    }
                }
                TokenTree::Ident(name) => {
                    let mut path = vec![name.to_string()];
                    while let (true, true, Some(TokenTree::Ident(next))) =
                        (is(at, ':'), is(at + 1, ':'), tokens.get(at + 2))
                    {
                        path.push(next.to_string());
                        at += 3;
                    }
                    if is(at, '!') && !is(at + 1, '=') {
                        self.macros.push((line(name), path[path.len() - 1].clone()));
                    }
                    if path.len() > 1 {
                        self.paths.push((line(name), path));
                    }
                }
                TokenTree::Punct(_) => {}
            }
        }
    }

    fn add_function(&mut self, signature: &Signature, block: Option<&Block>) {
        if let Some(block) = block {
            let (start, end) = (line(&signature.fn_token), block.brace_token.span.close().end().line);
            self.functions.push((start, signature.ident.to_string(), end + 1 - start));
        }
    }
}

fn line(code: &impl Spanned) -> usize {
    code.span().start().line
}

/// Whether an item exists in tests only: `#[cfg(test)]` or `#[cfg(all(test, …))]`.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let condition = attribute.meta.require_list().map(|list| list.tokens.to_string()).unwrap_or_default();
        attribute.path().is_ident("cfg") && (condition == "test" || condition.replace(' ', "").starts_with("all(test,"))
    })
}

impl<'ast> Visit<'ast> for Source {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Const(item) => &item.attrs,
            Item::Enum(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Macro(item) => &item.attrs,
            Item::Mod(item) => &item.attrs,
            Item::Static(item) => &item.attrs,
            Item::Struct(item) => &item.attrs,
            Item::Trait(item) => &item.attrs,
            Item::Type(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        match item {
            Item::Mod(ItemMod { ident, content: None, .. }) if is_test(attributes) => {
                let path = self.module.iter().cloned().chain([ident.to_string()]).collect::<Vec<_>>().join("/");
                self.test_files.push(path);
            }
            _ if is_test(attributes) => {}
            _ => visit::visit_item(self, item),
        }
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        let test = match item {
            ImplItem::Const(item) => is_test(&item.attrs),
            ImplItem::Fn(item) => is_test(&item.attrs),
            _ => false,
        };
        if !test {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_trait_item(&mut self, item: &'ast TraitItem) {
        if !matches!(item, TraitItem::Fn(item) if is_test(&item.attrs)) {
            visit::visit_trait_item(self, item);
        }
    }

    fn visit_field(&mut self, field: &'ast syn::Field) {
        if !is_test(&field.attrs) {
            visit::visit_field(self, field);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.add_use(&item.tree, &[]);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if names.len() > 1 {
            self.paths.push((line(path), names));
        }
        visit::visit_path(self, path);
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if !attribute.path().is_ident("doc") {
            visit::visit_attribute(self, attribute);
        }
    }

    fn visit_token_stream(&mut self, tokens: &'ast TokenStream) {
        self.add_tokens(tokens);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        if let Some(name) = call.path.segments.last() {
            self.macros.push((line(name), name.ident.to_string()));
        }
        visit::visit_macro(self, call);
    }

    fn visit_lit_str(&mut self, text: &'ast syn::LitStr) {
        self.texts.push((line(text), text.value()));
    }

    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.add_function(&function.sig, Some(&function.block));
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.add_function(&function.sig, Some(&function.block));
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        self.add_function(&function.sig, function.default.as_ref());
        visit::visit_trait_item_fn(self, function);
    }

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        let receiver = match &*call.receiver {
            syn::Expr::Path(path) => path.path.segments.last().map(|segment| segment.ident.to_string()),
            syn::Expr::Field(field) => match &field.member {
                syn::Member::Named(name) => Some(name.to_string()),
                syn::Member::Unnamed(_) => None,
            },
            _ => None,
        };
        self.calls.push((line(&call.method), receiver.unwrap_or_default(), call.method.to_string()));
        visit::visit_expr_method_call(self, call);
    }

    fn visit_expr_unsafe(&mut self, code: &'ast syn::ExprUnsafe) {
        self.unsafes.push(line(&code.unsafe_token));
        visit::visit_expr_unsafe(self, code);
    }

    fn visit_safety(&mut self, safety: &'ast syn::Safety) {
        if let syn::Safety::Unsafe(token) = safety {
            self.unsafes.push(line(token));
        }
    }
}

pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn add_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            add_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

fn read_all() -> Vec<Source> {
    let mut paths = Vec::new();
    add_files(&folder(), &mut paths);
    // The build script is not part of the program.
    paths.retain(|path| *path != folder().join("build.rs"));
    paths.sort();
    let source = |path: PathBuf| {
        let file = path.strip_prefix(folder()).expect("a path below src").display().to_string();
        Source::parse(&file, &fs::read_to_string(&path).expect("a source file"))
    };
    paths.into_iter().map(source).collect()
}

/// Every file below `src`, tests included.
pub(crate) fn all_sources() -> &'static [Source] {
    static SOURCES: LazyLock<Vec<Source>> = LazyLock::new(read_all);
    &SOURCES
}

/// Every file below `src` except modules under `#[cfg(test)]`.
pub(crate) fn sources() -> impl Iterator<Item = &'static Source> {
    let tests: Vec<&String> = all_sources().iter().flat_map(|source| &source.test_files).collect();
    let is_test = move |source: &Source| {
        let stem = Path::new(source.file.trim_end_matches(".rs"));
        tests.iter().any(|test| stem.starts_with(test))
    };
    all_sources().iter().filter(move |source| !is_test(source))
}
