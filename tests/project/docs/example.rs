//! The example of the README compiles.

use super::markdown::code_blocks;
use super::text;

/// The README's example. It is only compiled: it renders a whole picture, to the current folder.
fn example() -> Result<(), Box<dyn std::error::Error>> {
    let scene = stride::Scene::load("scenes/cover.toml")?;
    let report = stride::Render::new(&scene).samples(64).threads(2).run()?;
    report.save("cover.png")?;
    Ok(())
}

#[test]
fn the_example_of_the_readme_compiles() {
    let _: fn() -> Result<(), Box<dyn std::error::Error>> = example;
    let blocks = code_blocks(&text("README.md"));
    let [block] = blocks.iter().filter(|block| block.language == "rust").collect::<Vec<_>>()[..] else {
        panic!("README.md has one example in Rust");
    };
    let (_, body) = include_str!("example.rs").split_once("fn example()").expect("the function");
    let lines: Vec<_> = body.lines().skip(1).map(str::trim).take_while(|line| *line != "Ok(())").collect();
    assert_eq!(block.text.lines().collect::<Vec<_>>(), lines);
}
