#![doc = include_str!("links.md")]
#![doc = include_str!("README.md")]

// The first definition of a link counts: `links.md` gives those of this documentation, each page those for readers of the files.
macro_rules! pages {
    ($($name:ident $file:literal)*) => {$(
        #[doc = include_str!("links.md")]
        #[doc = include_str!($file)]
        pub mod $name {}
    )*};
}

pages! {
    tutorial "tutorial.md"
    calibrate "calibrate.md"
    choose "choose.md"
    diagnose "diagnose.md"
    confirm "confirm.md"
    sweep "sweep.md"
    blind_cases "blind_cases.md"
    replay "replay.md"
    library "library.md"
    concepts "concepts.md"
    physics "physics.md"
    validation "validation.md"
    paper "paper.md"
    commands "commands.md"
    effects "effects.md"
    recording "recording.md"
    speed "speed.md"
    glossary "glossary.md"
    architecture "architecture.md"
    add_effect "add_effect.md"
    add_measurement "add_measurement.md"
    add_optimiser "add_optimiser.md"
}
